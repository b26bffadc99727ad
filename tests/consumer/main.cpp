// A robot stands still for two seconds: the estimator must start, stay where it is, and look up.
#include <cmath>
#include <cstdio>
#include <kilvo/estimator/estimator.hpp>

int main() {
  kilvo::Robot robot;  // where each sensor sits: robot.lidar.T_imu_lidar, ...
  kilvo::EstimatorConfig config;
  kilvo::Estimator estimator(robot, config, {true, false, true, false});  // use imu and lidar; no legs, no camera

  kilvo::State last;
  int outputs = 0;
  for (int i = 0; i < 400; ++i) {
    kilvo::ImuSample sample;
    sample.t = kilvo::time_from_ns(i * 5'000'000LL);
    sample.accel = {0, 0, 9.81};
    for (const kilvo::Output& output : estimator.push(sample)) {
      last = output.x;  // rotation, position, velocity, biases; output.P is its covariance
      ++outputs;
    }
  }
  for (const kilvo::Output& output : estimator.finish()) last = output.x;

  std::printf("%d outputs, last position %.3f %.3f %.3f m\n", outputs, last.p.x(), last.p.y(), last.p.z());
  return outputs > 100 && last.p.norm() < 0.05 && std::abs(last.R.matrix()(2, 2) - 1) < 1e-3 ? 0 : 1;
}
