// What images do for the estimate of a walking humanoid, and what bad ones must not do.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <random>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/failures.hpp"
#include "tests/faults/failing_walk.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo {
namespace images_test {

using testing::HasSubstr;

constexpr std::array<bool, sensor_count> liv = {true, false, true, true}, li = {true, false, true, false};

struct Drive {
  Statistics statistics;
  double error = 0;      // of position, root mean square, m
  double worst_tau = 0;  // of the exposure that the images had against that of the first, as a share
  std::map<Modality, int> outputs;
  std::map<Modality, std::string> cause;  // the last
  std::size_t coloured = 0;
  std::vector<std::pair<double, Modality>> modalities;  // by time, s
};

// Ten seconds through a room, seen by a camera of half size.
class Images : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    lab::SimulatorConfig config = test::seen_by_half_a_camera(10, 8000);
    config.use[static_cast<std::size_t>(Sensor::legs)] = true;
    simulator_ = std::make_unique<lab::Simulator>(test::scenario("room"), config);
    settings_ = std::make_unique<lab::Settings>(
        lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots"));
    while (auto m = simulator_->next()) walk_.push_back(*std::move(m));
  }
  static void TearDownTestSuite() {
    simulator_.reset();
    settings_.reset();
    walk_.clear();
  }

  // `edit` may change an image or, by returning false, keep it away; it is given the time since the start, s.
  static Drive drive(std::array<bool, sensor_count> used, const std::function<bool(CameraImage&, double)>& edit = {},
                     const std::function<void(Robot&)>& mount = {}) {
    Robot robot = settings_->robot;
    if (mount) mount(robot);
    Estimator estimator(robot, settings_->estimator, used);
    Drive out;
    double sum = 0;
    int count = 0;
    std::optional<SE3> T_WR;
    std::optional<double> first_exposure;
    const auto take = [&](const std::vector<Output>& outputs) {
      for (const Output& o : outputs) {
        const double t = simulator_->seconds_of(o.t);
        const SE3 truth = simulator_->walk().imu(t);
        if (!T_WR) T_WR = o.x.pose() * truth.inverse();
        sum += (o.x.p - (*T_WR * truth).p).squaredNorm();
        ++count;
        ++out.outputs[o.modality];
        out.modalities.emplace_back(t, o.modality);
        out.cause[o.modality] = text_of(o.cause);
        out.coloured += o.coloured.size();
        if (!o.is_image) continue;
        const double exposure = lab::exposure_at(simulator_->config().camera, t);
        if (!first_exposure) first_exposure = exposure * o.x.tau;
        out.worst_tau = std::max(out.worst_tau, std::abs(o.x.tau * exposure / *first_exposure - 1));
      }
    };
    for (Measurement m : walk_) {
      auto* image = std::get_if<CameraImage>(&m);
      if (image != nullptr && edit && !edit(*image, simulator_->seconds_of(image->t))) continue;
      take(estimator.push(std::move(m)));
    }
    take(estimator.finish());
    out.error = std::sqrt(sum / count);
    out.statistics = estimator.statistics();
    return out;
  }

  static const SensorCount& camera_of(const Drive& d) { return d.statistics.sensors[static_cast<std::size_t>(Sensor::camera)]; }

  static std::unique_ptr<lab::Simulator> simulator_;
  static std::unique_ptr<lab::Settings> settings_;
  static std::vector<Measurement> walk_;
};

std::unique_ptr<lab::Simulator> Images::simulator_;
std::unique_ptr<lab::Settings> Images::settings_;
std::vector<Measurement> Images::walk_;

TEST_F(Images, HelpAndTheExposureIsFollowed) {
  const Drive with = drive(liv), without = drive(li);
  EXPECT_LT(with.error, 1.05 * without.error);
  EXPECT_LT(with.error, 0.003);
  EXPECT_GT(camera_of(with).used, 90U);
  EXPECT_LT(with.worst_tau, 0.03);
  EXPECT_GT(with.outputs.at(Modality::liv), 9 * with.outputs.at(Modality::li));
  EXPECT_GT(with.coloured, 10000U);
  EXPECT_THAT(warnings_of(with.statistics), testing::Not(testing::Contains(HasSubstr("turned"))));
}

TEST_F(Images, OfAClockThatIsOffAreShifted) {
  const auto camera = static_cast<std::size_t>(Sensor::camera);
  const Drive late = drive(liv, [](CameraImage& i, double) {
    i.t += std::chrono::milliseconds(15);
    return true;
  });
  // Two thirds of it after ten seconds of small images; what is left is found later.
  EXPECT_NEAR(late.statistics.clock_shift[camera], -0.015, 0.005);
  EXPECT_THAT(warnings_of(late.statistics), testing::Contains(HasSubstr("set camera.time_offset to")));
  EXPECT_EQ(drive(liv).statistics.clock_shift[camera], 0);
}

TEST_F(Images, ACameraThatGoesIsMissedAndOneThatComesBackIsUsed) {
  const Drive d = drive(liv, [](CameraImage&, double t) { return t < 4 || t > 7; });
  EXPECT_NEAR(d.outputs.at(Modality::li) / 200.0, 3 - 0.3, 0.6);
  EXPECT_STREQ(d.cause.at(Modality::liv).c_str(), "images are used");
  EXPECT_EQ(d.cause.at(Modality::li), "camera lost");
  EXPECT_LT(d.error, 0.003);
}

TEST_F(Images, BadOnesAreCountedAndCostNothingButThemselves) {
  const double good = drive(liv).error;
  struct Case {
    const char* cause;  // of the drops; empty: used, but says nothing
    std::function<bool(CameraImage&, double)> edit;
  };
  const auto grey = [](std::uint8_t value) {
    return [value](CameraImage& i, double t) {
      if (t > 4 && t < 6) std::ranges::fill(i.image.pixels, value);
      return true;
    };
  };
  CameraImage last;
  const std::vector<Case> cases = {
      {"frozen", grey(0)},
      {"frozen", grey(255)},
      {"empty",
       [](CameraImage& i, double t) {
         if (t > 4 && t < 6) i.image = {};
         return true;
       }},
      {"another size than configured",
       [](CameraImage& i, double t) {
         if (t > 4 && t < 6) i.image.height /= 2, i.image.pixels.resize(i.image.pixels.size() / 2);
         return true;
       }},
      {"frozen",
       [&last](CameraImage& i, double t) {
         if (t > 4 && t < 6) i.image = last.image;
         last = i;
         return true;
       }},
      {"late",
       [](CameraImage& i, double t) {
         if (t > 6 && t < 7) i.t -= std::chrono::seconds(5);
         return true;
       }},
      {"",
       [&last](CameraImage& i, double t) {
         const CameraImage whole = i;
         const auto half = static_cast<std::ptrdiff_t>(i.image.pixels.size() / 2);
         if (t > 4 && t < 6) std::copy_n(last.image.pixels.begin(), half, i.image.pixels.begin());
         last = whole;
         return true;
       }},
  };
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Drive d = drive(liv, cases[k].edit);
    EXPECT_LT(d.error, 1.5 * good + 0.0005) << k;
    if (cases[k].cause[0] == 0) continue;
    EXPECT_GE(camera_of(d).dropped.at(cases[k].cause), 9U) << k;
  }
}

TEST_F(Images, ACameraTurnedByThreeDegreesIsSpokenOf) {
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
    const Drive d = drive(liv, {}, [&](Robot& r) { r.camera.T_imu_camera.R = SO3::Exp(3 * M_PI / 180 * axis) * r.camera.T_imu_camera.R; });
    EXPECT_THAT(warnings_of(d.statistics), testing::Contains(HasSubstr("camera.T_imu_camera.R"))) << axis.transpose();
  }
}

// A camera that is described wrongly carries nothing once the robot has walked for a second. While it stands, patches fit at the wrong
// place as well.
TEST_F(Images, OfAWronglyDescribedCameraCarryNothing) {
  const std::vector<std::pair<const char*, std::function<void(Robot&)>>> wrong = {
      {"cx and cy swapped", [](Robot& r) { std::swap(r.camera.cx, r.camera.cy); }},
      {"fx halved", [](Robot& r) { r.camera.fx /= 2; }},
      {"mount inverted", [](Robot& r) { r.camera.T_imu_camera = r.camera.T_imu_camera.inverse(); }}};
  double walks = 0;
  while (simulator_->walk().velocity(walks).norm() < 0.1) walks += 0.01;
  for (const auto& [what, mount] : wrong) {
    for (const bool with_legs : {false, true}) {
      const Drive d = drive({true, with_legs, true, true}, {}, mount);
      double last = 0;
      for (const auto& [t, modality] : d.modalities) last = has_camera(modality) ? t : last;
      std::printf("%s: %s until %.2f s, walking from %.2f s; error %.2f mm\n", what, with_legs ? "KILV" : "LIV", last, walks,
                  1e3 * d.error);
      EXPECT_LT(last, walks + 1) << what;
      EXPECT_LT(d.error, 0.01) << what;
    }
  }
}

// Images that are turned by three degrees for ten seconds: the mount is doubted, and ten seconds after that the camera is tried again.
TEST(Camera, ThatWasTurnedAndIsRightAgainIsUsedAgain) {
  const test::FailingWalk walk("room", 1, 19, true);
  constexpr int shift = 5;  // of 160 pixels, at 85 pixels a radian
  const auto turned = [](Measurement& m, double s) {
    auto* image = std::get_if<CameraImage>(&m);
    if (image == nullptr || s > 10) return true;
    std::vector<std::uint8_t>& pixels = image->image.pixels;
    std::rotate(pixels.begin(), pixels.begin() + shift * image->image.channels, pixels.end());
    return true;
  };
  const test::Outcome o = walk.with({}, {liv, turned, {}, {}});
  std::optional<double> doubted, back;
  for (const Event& e : o.statistics.events) {
    if (e.reason == Reason::camera_turned && !doubted) doubted = walk.seconds_of(e.t);
  }
  ASSERT_TRUE(doubted);
  for (const test::Moment& m : o.moments) {
    if (m.s > *doubted + 1 && has_camera(m.modality) && !back) back = m.s;
  }
  ASSERT_TRUE(back);
  std::printf("doubted at %.2f s, used again from %.2f s\n", *doubted, *back);
  EXPECT_LT(*doubted, 10);
  EXPECT_NEAR(*back - *doubted, 10, 1);
  EXPECT_EQ(o.moments.back().modality, Modality::liv);
  EXPECT_LT(o.worst(&test::Moment::error, 0, 19), 0.01);
}

TEST_F(Images, ACoveredLensSaysNothingAndTeachesNothing) {
  std::mt19937 random(5);
  const auto covered = [&random](CameraImage& i, double t) {
    if (t < 4 || t > 5.5) return true;
    for (std::uint8_t& p : i.image.pixels) p = static_cast<std::uint8_t>(random() % 8);
    return true;
  };
  const Drive d = drive(liv, covered), good = drive(liv);
  EXPECT_GT(camera_of(d).dropped.at("agrees with nothing"), 10U);
  EXPECT_TRUE(d.outputs.contains(Modality::li));
  EXPECT_LT(d.error, 1.5 * good.error + 0.0005);
}

TEST_F(Images, OfAnyBufferAreReadWithinIt) {
  const Drive d = drive(liv, [](CameraImage& i, double t) {
    if (t > 4 && t < 5) i.image.pixels.resize(i.image.pixels.size() / 3);
    if (t > 6 && t < 7) i.image.channels = 0;
    return true;
  });
  EXPECT_GE(camera_of(d).dropped.at("cut short"), 8U);
  EXPECT_GE(camera_of(d).dropped.at("neither grey nor colour"), 8U);
}

TEST_F(Images, WithoutTheLidarAreNotUsed) {
  Estimator estimator(settings_->robot, settings_->estimator, liv);
  for (const Measurement& m : walk_) {
    const double t = simulator_->seconds_of(stamp_of(m));
    if (std::holds_alternative<LidarScan>(m) && t > 4 && t < 6) continue;
    for (const Output& o : estimator.push(m)) {
      const double now = simulator_->seconds_of(o.t);
      if (now < 4.6 || now > 6) continue;
      EXPECT_EQ(o.modality, Modality::coast) << now;
    }
  }
  EXPECT_GT(estimator.statistics().sensors[static_cast<std::size_t>(Sensor::camera)].dropped.at("no LiDAR"), 10U);
}

TEST_F(Images, WithoutAnySweepAreDropped) {
  const Drive d = drive({true, false, false, true});
  EXPECT_EQ(camera_of(d).used, 0U);
  EXPECT_GT(camera_of(d).dropped.at("before the first sweep"), 50U);
  EXPECT_EQ(d.outputs.size(), 1U);
  EXPECT_TRUE(d.outputs.contains(Modality::coast));
}

}  // namespace images_test
}  // namespace kilvo
