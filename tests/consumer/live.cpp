// A robot stands still for two seconds; its messages are those of ROS 2, its description is a YAML file, and the live runner answers.
#include <apps/live/live_runner.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <lab/messages/encode.hpp>
#include <lab/messages/message_decoder.hpp>
#include <lab/settings/settings.hpp>
#include <thread>

int main(int, char** argv) {
  using namespace kilvo;
  const lab::Settings settings = lab::load_settings(argv[1]);
  const std::array<bool, sensor_count> used{true, false, false, false};
  Estimator estimator(settings.robot, settings.estimator, used);
  std::atomic<int> outputs{0};
  live::LiveRunner runner(estimator, settings.robot, settings.estimator, used, settings.live, {[&](Output) { ++outputs; }, [](Output) {}});
  for (int i = 0; i < 400; ++i) {
    ImuSample sample;
    sample.t = time_from_ns(1'000'000'000 + i * 5'000'000LL);
    sample.accel = {0, 0, 9.81};
    const auto bytes = lab::encode(sample, "imu", lab::Encoding::cdr);  // as it would have come over DDS
    auto decoded = lab::decode_measurement(Sensor::imu, "sensor_msgs/Imu", {bytes, lab::Encoding::cdr}, {});
    if (!decoded) return 1;
    runner.push(std::move(decoded->measurement));
    while (!runner.is_idle()) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  runner.stop();
  std::printf("%d live outputs\n", outputs.load());
  return outputs > 100 ? 0 : 1;
}
