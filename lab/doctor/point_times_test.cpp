// Times of the points within a sweep that are not those of the measurement: their cause is named, and neither gyro nor clock.
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lab/doctor/description_watch.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "lab/simulation/simulator.hpp"

namespace kilvo::lab {
namespace point_times_test {

using testing::ElementsAre;
using testing::IsEmpty;

/// A walk in a room without legs, whose poses are known.
struct Walked {
  std::unique_ptr<Simulator> simulator;
  std::vector<Measurement> measurements;
  Robot robot;
  SE3 T_imu_lidar;

  /// The LiDAR in the world.
  SE3 lidar(Time t) const { return simulator->walk().imu(simulator->seconds_of(t)) * T_imu_lidar; }
};

const Walked& walked() {
  static const Walked walk = [] {
    SimulatorConfig config;
    config.duration = 16;
    config.use = {true, false, true, false};
    config.lidar.points = 8000;
    const std::vector<Scenario> all = scenarios();
    Walked out;
    out.simulator = std::make_unique<Simulator>(*std::ranges::find(all, "room", &Scenario::name), config);
    while (auto measurement = out.simulator->next()) out.measurements.push_back(*std::move(measurement));
    const std::string urdf = std::string(KILVO_SOURCE_DIR) + "/config/robots/sim.urdf";
    out.robot = parse_settings(simulated_config(config, urdf), "simulated", ".").robot;
    out.T_imu_lidar = out.robot.lidar.T_imu_lidar;
    return out;
  }();
  return walk;
}

using Change = std::function<void(LidarScan&)>;

Recorded recorded(const Change& change, const Reading& reading = {}) {
  Recorder recorder(reading);
  for (Measurement measurement : walked().measurements) {
    if (auto* scan = std::get_if<LidarScan>(&measurement)) change(*scan);
    recorder.push(measurement);
  }
  return recorder.finish();
}

std::vector<std::string> causes(const std::vector<Finding>& findings) {
  std::vector<std::string> out;
  for (const Finding& finding : findings) out.push_back(finding.cause);
  return out;
}

std::vector<std::string> causes(const Recorded& recorded) { return causes(Examination(recorded, walked().robot).run().findings); }

/// As a driver does it that takes all points to where the LiDAR is so long after the stamp, and leaves their times as they are.
Change deskewed_to(Duration after) {
  return [after](LidarScan& scan) {
    const SE3 back = walked().lidar(scan.t + after).inverse();
    for (LidarPoint& point : scan.points) {
      const SE3 there = back * walked().lidar(scan.t + Duration(point.offset_ns));
      const Eigen::Vector3f p = (there * Eigen::Vector3d(point.x, point.y, point.z)).cast<float>();
      point.x = p.x(), point.y = p.y(), point.z = p.z();
    }
  };
}

Change times_by(double factor) {
  return [factor](LidarScan& scan) {
    for (LidarPoint& point : scan.points) point.offset_ns = static_cast<std::int32_t>(factor * point.offset_ns);
  };
}

TEST(PointTimes, CloudsThatAreDeskewedAlreadyAreNamedAndNothingElse) {
  for (const int after : {0, 50, 100}) {
    const Diagnosis diagnosis = Examination(recorded(deskewed_to(std::chrono::milliseconds(after))), walked().robot).run();
    ASSERT_THAT(causes(diagnosis.findings), ElementsAre("clouds_deskewed")) << after;
    const Finding& finding = diagnosis.findings.front();
    EXPECT_NEAR(finding.size, 1e-3 * after, 3e-3) << "where the clouds are deskewed to, after the stamp";
    ASSERT_EQ(finding.changes.size(), after > 0 ? 2U : 1U) << finding.remedy;
    EXPECT_EQ(finding.changes[0].key + "=" + finding.changes[0].value, "lidar.deskew=false");
    if (after > 0) {
      EXPECT_EQ(finding.changes[1].key, "lidar.time_offset");
      EXPECT_NEAR(std::stod(finding.changes[1].value), 1e-3 * after, 3e-3);
    }
    for (const auto& change : finding.changes) EXPECT_THAT(finding.remedy, testing::HasSubstr(change.key + ": " + change.value));
  }
}

TEST(PointTimes, ARunIsToldOfDeskewedCloudsInItsFirstSeconds) {
  for (const int after : {0, 100}) {
    const Change change = deskewed_to(std::chrono::milliseconds(after));
    DescriptionWatch watch(walked().robot, {}, DescriptionWatch::Judging::here);
    for (Measurement measurement : walked().measurements) {
      if (auto* scan = std::get_if<LidarScan>(&measurement)) change(*scan);
      watch.take(measurement);
    }
    std::vector<Finding> findings;
    for (const WrongDescription& wrong : watch.finish()) {
      findings.push_back(wrong.finding);
      EXPECT_TRUE(wrong.spoils);
      EXPECT_TRUE(wrong.is_mendable);
    }
    EXPECT_THAT(causes(findings), ElementsAre("clouds_deskewed")) << after;
  }
}

/// As clouds are read with lidar.deskew: false, and lidar.time_offset.
Change at_once(const Change& change, Duration time_offset) {
  return [change, time_offset](LidarScan& scan) {
    change(scan);
    scan.t += time_offset;
    for (LidarPoint& point : scan.points) point.offset_ns = 0;
  };
}

TEST(PointTimes, OfDeskewedCloudsAreNoFaultOnceTheyAreNotUsed) {
  for (const int after : {0, 50, 100}) {
    const auto there = std::chrono::milliseconds(after);
    EXPECT_THAT(causes(recorded(at_once(deskewed_to(there), there), {.without_deskew = true})), IsEmpty()) << after;
  }
}

// A half of a sweep of another stamp is then a fault of the clock, and not of the times.
TEST(PointTimes, WhereTheyAreNotUsedTheClockIsJudged) {
  const auto there = std::chrono::milliseconds(50);
  const Recorded early = recorded(at_once(deskewed_to(there), Duration(0)), {.without_deskew = true});
  const Diagnosis diagnosis = Examination(early, walked().robot).run();
  ASSERT_THAT(causes(diagnosis.findings), ElementsAre("lidar_clock"));
  EXPECT_NEAR(diagnosis.findings.front().size, 0.05, 3e-3);
}

TEST(PointTimes, ThatAreAbsentAreAFaultOnlyWhereTheyAreToBeUsed) {
  const Change none = at_once([](LidarScan&) {}, std::chrono::milliseconds(50));
  EXPECT_THAT(causes(recorded(none)), ElementsAre("point_times_absent"));
  EXPECT_THAT(causes(recorded(none, {.without_deskew = true})), testing::Not(testing::Contains("point_times_absent")));
}

TEST(PointTimes, TimesThatAreTooLongOrRunBackwardsAreNamedAndNothingElse) {
  for (const double factor : {1.5, 2.0, 3.0}) EXPECT_THAT(causes(recorded(times_by(factor))), ElementsAre("point_times_unit")) << factor;
  const Change reverse = [](LidarScan& scan) {
    const auto [first, last] = offsets_of(scan);
    for (LidarPoint& point : scan.points) point.offset_ns = first + last - point.offset_ns;
  };
  EXPECT_THAT(causes(recorded(reverse)), ElementsAre("point_times_reversed"));
}

// Each message holds the sweep before as well: the times are right, though they span twice the interval of the messages.
TEST(PointTimes, SweepsThatOverlapAreNotAccused) {
  const auto overlap = [before = std::optional<LidarScan>()](LidarScan& scan) mutable {
    const LidarScan own = scan;
    if (before) {
      const auto earlier = static_cast<std::int32_t>((scan.t - before->t).count());
      for (LidarPoint point : before->points) {
        point.offset_ns -= earlier;
        scan.points.push_back(point);
      }
    }
    before = own;
  };
  EXPECT_THAT(causes(recorded(overlap)), IsEmpty());
}

// Of a robot that stands neither hypothesis makes a difference.
TEST(PointTimes, WhoStandsIsNotJudged) {
  Recorded standing = recorded(deskewed_to(Duration(0)));
  std::erase_if(standing.imu, [](const InertialSample& s) { return s.t > 3.7; });
  std::erase_if(standing.sweeps, [](const Sweep& s) { return s.t > 3.7; });
  EXPECT_THAT(causes(standing), IsEmpty());
}

// It turns the sweeps by too much or too little, which makes surfaces thicker: but less so than without any times.
TEST(PointTimes, AGyroOfAnotherScaleIsNoFaultOfTheTimes) {
  for (const double factor : {0.8, 1.25}) {
    Recorded scaled = recorded([](LidarScan&) {});
    for (InertialSample& s : scaled.imu) s.gyro *= factor;
    EXPECT_THAT(causes(scaled), ElementsAre("gyro_unit")) << factor;
  }
}

}  // namespace point_times_test
}  // namespace kilvo::lab
