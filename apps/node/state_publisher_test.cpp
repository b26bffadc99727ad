#include "apps/node/state_publisher.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>

#include "apps/live/levelling.hpp"
#include "lab/messages/ros_types.hpp"
#include "lab/messages/wire_reader.hpp"

namespace kilvo::node {
namespace state_publisher_test {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// As a listener reads them.
struct PoseView {
  lab::RosHeader header;
  std::array<double, 7> pose{};

  static void fields(auto& m, auto&& visit) { visit(m.header, m.pose); }
};
struct PathView {
  static constexpr const char* name = "path";
  lab::RosHeader header;
  std::vector<PoseView> poses;

  static void fields(auto& m, auto&& visit) { visit(m.header, m.poses); }
};
struct TransformView {
  lab::RosHeader header;
  std::string_view child;
  std::array<double, 7> pose{};

  static void fields(auto& m, auto&& visit) { visit(m.header, m.child, m.pose); }
};
struct TransformsView {
  static constexpr const char* name = "transforms";
  std::vector<TransformView> transforms;

  static void fields(auto& m, auto&& visit) { visit(m.transforms); }
};

SE3 pose_of(const TransformView& view) {
  const auto& p = view.pose;
  return {SO3::from_quaternion(Eigen::Quaterniond(p[6], p[3], p[4], p[5])), {p[0], p[1], p[2]}};
}

Time at(double s) { return Time(from_seconds(s)); }

/// A publisher whose messages are kept.
class Publishing : public testing::Test {
 protected:
  // A robot that walks along x at 1 m/s in a world that is `tilt` rad off about y.
  Output walking(double s, std::uint32_t epoch, double tilt = 0) const {
    Output o;
    o.t = at(s);
    o.epoch = epoch;
    const SO3 R = SO3::Exp(Eigen::Vector3d(0, tilt, 0));
    o.x.R = R;
    o.x.p = R * Eigen::Vector3d(s - 10, 0, 0);
    o.x.v = R * Eigen::Vector3d(1, 0, 0);
    o.P.diagonal().setConstant(1e-4);
    return o;
  }
  void walk(double from, double until, std::uint32_t epoch, double tilt = 0, bool is_level = false) {
    for (double s = from; s < until; s += 0.01) {
      Output o = walking(s, epoch, tilt);
      if (is_level) Levelling::apply(SO3::Exp(Eigen::Vector3d(0, -tilt, 0)), o);
      states_.take(o);
    }
  }
  std::vector<Eigen::Vector3d> path() {
    states_.publish_path();
    const auto decoded = lab::read_message<PathView>({sent_[Topic::path].back(), lab::Encoding::cdr});
    std::vector<Eigen::Vector3d> out;
    for (const PoseView& p : decoded->poses) out.emplace_back(p.pose[0], p.pose[1], p.pose[2]);
    return out;
  }
  std::vector<TransformsView> transforms() {
    std::vector<TransformsView> out;
    for (const auto& bytes : sent_[Topic::transforms]) out.push_back(*lab::read_message<TransformsView>({bytes, lab::Encoding::cdr}));
    return out;
  }
  static Event event(double s, Reason reason, std::uint64_t count) { return {at(s), {}, reason, 0, count, {}}; }

  Options options_ = [] {
    Options out;
    out.base = "imu";
    return out;
  }();
  lab::Settings settings_;
  BaseFrame base_{options_, settings_};
  std::map<Topic, std::vector<std::vector<std::uint8_t>>> sent_;
  StatePublisher states_{options_, settings_, base_,
                         Outlet{lab::Encoding::cdr, [](Topic) { return true; },
                                [this](Topic topic, Time, const auto& bytes) { sent_[topic].push_back(bytes); }}};
};

TEST_F(Publishing, AnEpochThatBeginsRestartsPathAndTransforms) {
  walk(10, 13, 0);
  ASSERT_THAT(path(), SizeIs(testing::Ge(29u)));
  sent_.clear();
  walk(10, 10.5, 1);  // the stamps go back, and the robot is at the start
  EXPECT_THAT(path(), SizeIs(testing::Le(6u)));
  EXPECT_LT(path().front().norm(), 1e-9);
  ASSERT_THAT(transforms(), SizeIs(testing::Ge(49u))) << "at once, not when the old time is reached";
  EXPECT_EQ(transforms().front().transforms.front().header.stamp, at(10));
  EXPECT_LT(std::abs(transforms().front().transforms.back().pose[0]), 1e-9) << "the smooth world as well";
  ASSERT_TRUE(states_.newest());
  EXPECT_EQ(states_.newest()->epoch, 1u);
}

TEST_F(Publishing, StatesOfAnEpochThatHasEndedAreLeftOut) {
  walk(10, 13, 0);
  Output o = walking(10, 1);
  o.events = {event(10, Reason::began_anew, 1)};
  states_.note_events(o);
  sent_.clear();
  walk(13, 13.1, 0);  // of the other thread, on their way since before
  EXPECT_THAT(sent_[Topic::odometry], IsEmpty());
  EXPECT_FALSE(states_.newest());
  walk(10, 10.1, 1);
  ASSERT_TRUE(states_.newest());
  EXPECT_THAT(states_.newest()->events, ElementsAre(event(10, Reason::began_anew, 1)));
}

TEST_F(Publishing, KeepsTheNewestOfEachEventOfTheEpoch) {
  walk(10, 11, 0);
  Output o = walking(11, 0);
  o.events = {event(10.5, Reason::gyro_clipped, 1), event(10.6, Reason::legs_lost, 1), event(10.9, Reason::gyro_clipped, 2)};
  states_.note_events(o);
  EXPECT_THAT(states_.newest()->events, ElementsAre(event(10.6, Reason::legs_lost, 1), event(10.9, Reason::gyro_clipped, 2)));
  Output next = walking(10, 1);
  next.events = {event(11.2, Reason::late, 20), event(10, Reason::began_anew, 1)};
  states_.note_events(next);
  states_.take(walking(10.01, 1));
  EXPECT_THAT(states_.newest()->events, ElementsAre(event(10, Reason::began_anew, 1))) << "of this one";
}

TEST_F(Publishing, AResetBeginsWithTheFirstEpochAgain) {
  walk(10, 10.1, 3);
  states_.clear();
  EXPECT_FALSE(states_.newest());
  walk(10, 10.1, 0);
  ASSERT_TRUE(states_.newest());
  EXPECT_EQ(states_.newest()->epoch, 0u);
}

TEST_F(Publishing, ALevelledWorldIsAStepInMapAndNoneInOdom) {
  const double tilt = 0.4 * M_PI / 180;
  walk(10, 13, 0, tilt);
  EXPECT_NEAR(path().back().z(), -3 * std::sin(tilt), 2e-3);
  walk(13, 16, 0, tilt, true);
  for (const Eigen::Vector3d& p : path()) ASSERT_NEAR(p.z(), 0, 1e-9) << "the whole way is in the level world";
  // map -> odom -> base: the best estimate moves by all of the turn at once, the smooth one by no more than a hundredth of a second allows.
  double largest_step = 0, largest_smooth = 0, last_best = 0, last_smooth = 0;
  for (const TransformsView& m : transforms()) {
    ASSERT_THAT(m.transforms, SizeIs(2));
    const double smooth = m.transforms[1].pose[2], best = (pose_of(m.transforms[0]) * pose_of(m.transforms[1])).p.z();
    largest_step = std::max(largest_step, std::abs(best - last_best));
    largest_smooth = std::max(largest_smooth, std::abs(smooth - last_smooth));
    last_best = best;
    last_smooth = smooth;
  }
  EXPECT_NEAR(largest_step, 3 * std::sin(tilt), 2e-3);
  EXPECT_LT(largest_smooth, 1e-3);
  EXPECT_NEAR(last_smooth, 0, 1e-3) << "after six times estimator.smooth_time";
}

}  // namespace state_publisher_test
}  // namespace kilvo::node
