// Cameras of other rates than usual, and images that arrive late, twice or not at all.
#include <algorithm>
#include <gtest/gtest.h>
#include <random>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo {
namespace arrival_test {

constexpr std::array<bool, sensor_count> liv = {true, false, true, true};
constexpr double seconds = 7, full_rate = 30;  // of the walk; Hz, of the images that are simulated

struct Drive {
  SensorCount camera;
  double error = 0;    // of position, root mean square, m
  int disordered = 0;  // outputs that are not later than the one before
};

std::uint64_t dropped(const Drive& d) {
  std::uint64_t sum = 0;
  for (const auto& [cause, count] : d.camera.dropped) sum += count;
  return sum;
}

// A message, and when it arrives, s.
struct Arrival {
  double t;
  Measurement m;
};

class Arrivals : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    lab::SimulatorConfig config = test::seen_by_half_a_camera(seconds, 6000);
    config.camera.delivery.rate = full_rate;
    simulator_ = std::make_unique<lab::Simulator>(test::scenario("room"), config);
    settings_ = std::make_unique<lab::Settings>(
        lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots"));
    while (auto m = simulator_->next()) walk_.push_back({simulator_->seconds_of(simulator_->arrived()), *std::move(m)});
  }
  static void TearDownTestSuite() {
    simulator_.reset();
    settings_.reset();
    walk_.clear();
  }

  // Of the images every `every`th; `edit` may change one and the time of its arrival or, by returning false, keep it away.
  template <class Edit>
  static Drive drive(int every, Edit&& edit) {
    std::vector<Arrival> arrivals;
    int index = 0;
    for (Arrival a : walk_) {
      auto* image = std::get_if<CameraImage>(&a.m);
      if (image != nullptr && (index++ % every != 0 || !edit(*image, a.t))) continue;
      arrivals.push_back(std::move(a));
    }
    std::ranges::stable_sort(arrivals, {}, &Arrival::t);
    Robot robot = settings_->robot;
    robot.camera.rate = full_rate / every;
    Estimator estimator(robot, settings_->estimator, liv);
    Drive out;
    double sum = 0;
    int count = 0;
    std::optional<SE3> T_WR;
    Time last{};
    const auto take = [&](const std::vector<Output>& outputs) {
      for (const Output& o : outputs) {
        const SE3 truth = simulator_->walk().imu(simulator_->seconds_of(o.t));
        if (!T_WR) T_WR = o.x.pose() * truth.inverse();
        sum += (o.x.p - (*T_WR * truth).p).squaredNorm();
        ++count;
        out.disordered += o.t <= last ? 1 : 0;
        last = o.t;
      }
    };
    for (Arrival& a : arrivals) take(estimator.push(std::move(a.m)));
    take(estimator.finish());
    out.error = std::sqrt(sum / count);
    out.camera = estimator.statistics().sensors[static_cast<std::size_t>(Sensor::camera)];
    return out;
  }
  static Drive drive(int every) {
    return drive(every, [](CameraImage&, double&) { return true; });
  }

  // How many images of a rate there are; the first ones come before the first sweep.
  static double images(int every) { return seconds * full_rate / every; }

  static std::unique_ptr<lab::Simulator> simulator_;
  static std::unique_ptr<lab::Settings> settings_;
  static std::vector<Arrival> walk_;
};

std::unique_ptr<lab::Simulator> Arrivals::simulator_;
std::unique_ptr<lab::Settings> Arrivals::settings_;
std::vector<Arrival> Arrivals::walk_;

constexpr double usual = 0.003;  // m

TEST_F(Arrivals, ACameraOfFiveHertzAndOneOfThirtyAreUsedWhole) {
  for (const int every : {1, 3, 6}) {
    const Drive d = drive(every);
    EXPECT_GT(static_cast<double>(d.camera.used), 0.75 * images(every)) << every;
    EXPECT_LT(d.error, usual) << every;
    EXPECT_EQ(d.disordered, 0) << every;
  }
}

TEST_F(Arrivals, ATenthOfASecondLateIsNotTooLate) {
  const Drive usual_delay = drive(3), d = drive(3, [](CameraImage&, double&t) {
                                        t += 0.1;
                                        return true;
                                      });
  EXPECT_GE(d.camera.used + 5, usual_delay.camera.used);
  EXPECT_LT(d.error, usual);
  EXPECT_EQ(d.disordered, 0);
}

TEST_F(Arrivals, FiveSecondsLateIsCountedAndLeftAlone) {
  const Drive d = drive(3, [](CameraImage& i, double& t) {
    const double stamp = simulator_->seconds_of(i.t);
    if (stamp > 1.5 && stamp < 2) t += 5;
    return true;
  });
  EXPECT_GE(dropped(d), 5U);
  EXPECT_GT(static_cast<double>(d.camera.used), 0.75 * images(3) - 6);
  EXPECT_LT(d.error, usual);
  EXPECT_EQ(d.disordered, 0);
}

TEST_F(Arrivals, OfTwoImagesOfOneTimeOneIsUsed) {
  Time before{};
  int index = 0;
  const Drive once = drive(6), d = drive(3, [&](CameraImage&i, double&) {
                                 if (index++ % 2 == 1) i.t = before;
                                 before = i.t;
                                 return true;
                               });
  EXPECT_LE(d.camera.used, once.camera.used + 1);
  EXPECT_GE(d.camera.used + 3, once.camera.used);
  EXPECT_GE(static_cast<double>(dropped(d)), 0.4 * images(3));
  EXPECT_LT(d.error, usual);
  EXPECT_EQ(d.disordered, 0);
}

TEST_F(Arrivals, HalfOfThemLostAtRandomCostNothingButThemselves) {
  std::mt19937 random(3);
  std::uint64_t kept = 0;
  const Drive d = drive(3, [&](CameraImage&, double&) {
    const bool keep = random() % 2 == 0;
    kept += keep ? 1U : 0U;
    return keep;
  });
  EXPECT_EQ(d.camera.used + dropped(d), kept);
  EXPECT_GT(static_cast<double>(d.camera.used), 0.75 * static_cast<double>(kept));
  EXPECT_LT(d.error, usual);
  EXPECT_EQ(d.disordered, 0);
}

}  // namespace arrival_test
}  // namespace kilvo
