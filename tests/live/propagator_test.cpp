#include <cmath>
#include <deque>
#include <gtest/gtest.h>
#include <map>

#include "kilvo/estimator/estimator.hpp"
#include "kilvo/estimator/live_propagator.hpp"
#include "kilvo/legs/leg_kinematics.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo {
namespace propagator_test {

struct Legs {
  std::map<Time, Contacts> contacts;
  std::map<Time, Eigen::Vector3d> p;
};

// A walk on the legs alone, answered by a propagator that is forked ten times a second, while the legs' messages come `late`.
Legs lived(Duration late, const Robot& robot, const std::vector<Measurement>& walk) {
  const std::array<bool, sensor_count> used = {true, true, false, false};
  Estimator estimator(robot, {}, used);
  LegKinematics kinematics(robot);
  LivePropagator propagator(robot, {});
  std::deque<JointSample> held;
  std::optional<Time> forked;
  Legs out;
  const auto push = [&](const JointSample& joints) {
    const auto known = kinematics.feet(joints);
    if (const auto* feet = std::get_if<Feet>(&known); feet != nullptr && propagator.push(*feet)) {
      const Output o = propagator.output();
      out.contacts[joints.t] = *o.contacts;
      out.p[joints.t] = o.x.p;
    }
    estimator.push(joints);
  };
  for (const Measurement& m : walk) {
    if (const auto* joints = std::get_if<JointSample>(&m)) {
      held.push_back(*joints);
      continue;
    }
    const auto& imu = std::get<ImuSample>(m);
    while (!held.empty() && held.front().t + late <= imu.t) {
      push(held.front());
      held.pop_front();
    }
    propagator.expect_legs_after(late);
    propagator.push(imu);
    estimator.push(imu);
    if (forked && imu.t - *forked < std::chrono::milliseconds(100)) continue;
    if (estimator.fork(propagator)) forked = imu.t;
  }
  return out;
}

TEST(LivePropagator, PairsALegSampleWithTheGyroOfItsOwnTime) {
  const lab::SimulatorConfig config = test::only({Sensor::imu, Sensor::legs}, 8);
  lab::Simulator simulator(test::scenario("room"), config);
  const Robot robot =
      lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots").robot;
  const std::vector<Measurement> walk = test::all_of(simulator);
  const Legs in_time = lived(Duration(0), robot, walk), late = lived(std::chrono::milliseconds(20), robot, walk);
  int same = 0, compared = 0;
  double worst = 0, sum = 0;
  for (const auto& [t, c] : late.contacts) {
    const auto other = in_time.contacts.find(t);
    if (other == in_time.contacts.end()) continue;
    ++compared;
    same += c.on == other->second.on ? 1 : 0;
    const double off = (late.p.at(t) - in_time.p.at(t)).norm();
    worst = std::max(worst, off);
    sum += off;
  }
  RecordProperty("same", std::to_string(same));
  EXPECT_GT(compared, 3000);
  EXPECT_GT(same, 0.995 * compared) << same << " of " << compared << ", positions differ by " << worst << " m at the most, "
                                    << sum / compared;
}

}  // namespace propagator_test
}  // namespace kilvo
