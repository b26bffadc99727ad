#include "lab/simulation/camera_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/simulation/random.hpp"

namespace kilvo::lab {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::uint64_t stream = 41;
constexpr std::size_t draws = 4096;  // of the noise table: 12 bits choose one

struct NoSum {
  NoSum& operator+=(const NoSum&) { return *this; }
};

Eigen::Vector2d distort(const std::array<double, 4>& k, const Eigen::Vector2d& x) {
  const double r2 = x.squaredNorm(), radial = 1 + r2 * (k[0] + r2 * k[1]);
  return {x.x() * radial + 2 * k[2] * x.x() * x.y() + k[3] * (r2 + 2 * x.x() * x.x()),
          x.y() * radial + k[2] * (r2 + 2 * x.y() * x.y()) + 2 * k[3] * x.x() * x.y()};
}

}  // namespace

SE3 CameraModel::mount() {
  Eigen::Matrix3d optical;  // z forward, x right, y down
  optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const double down = 10 * pi / 180;
  return {SO3::Exp({0, down, 0}) * SO3::nearest(optical), {0.09, 0.01, 0.36}};
}

Eigen::Vector2d project(const CameraModel& m, const Eigen::Vector3d& p_C) {
  const Eigen::Vector2d x = distort(m.distortion, p_C.head<2>() / p_C.z());
  return {m.fx * x.x() + m.cx, m.fy * x.y() + m.cy};
}

Eigen::Vector3d unproject(const CameraModel& m, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d seen((pixel.x() - m.cx) / m.fx, (pixel.y() - m.cy) / m.fy);
  Eigen::Vector2d x = seen;
  for (int i = 0; i < 20; ++i) x += seen - distort(m.distortion, x);
  return Eigen::Vector3d(x.x(), x.y(), 1).normalized();
}

double exposure_at(const CameraModel& m, double t) {
  return m.exposure * (1 + m.exposure_swing * std::sin(2 * pi * t / m.exposure_period));
}

CameraSensor::CameraSensor(const SimulatorConfig& config, const World& world) : config_(config), world_(world) {
  const CameraModel& m = config.camera;
  for (int v = 0; v < m.height; ++v) {
    for (int u = 0; u < m.width; ++u) directions_.emplace_back(unproject(m, {u, v}).cast<float>());
  }
  Random random(config.seed, stream);
  double sum = 0, squares = 0;
  std::vector<double> table(draws);
  for (double& x : table) x = random.gaussian(), sum += x;
  for (double& x : table) x -= sum / draws, squares += x * x;
  for (const double x : table) gaussian_.push_back(static_cast<float>(x / std::sqrt(squares / draws)));
}

Image CameraSensor::image(std::int64_t index, double t, const std::function<SE3(double)>& torso_at, const Workers& workers) const {
  const CameraModel& m = config_.camera;
  const double exposure = exposure_at(m, t);
  const int samples = std::max(1, m.blur_samples);
  std::vector<SE3> poses;
  poses.reserve(static_cast<std::size_t>(samples));
  for (int k = 0; k < samples; ++k) poses.push_back(torso_at(t + exposure * ((k + 0.5) / samples - 0.5)) * m.T_torso_camera);
  const auto brightness = static_cast<float>(255 * exposure * m.gain / samples);
  const auto read = static_cast<float>(m.read_noise * m.read_noise), photon = static_cast<float>(m.photon_noise);
  const double pixel_angle = 1 / m.fx;

  Image out{m.width, m.height, 3, std::vector<std::uint8_t>(directions_.size() * 3)};
  const auto expose = [&](std::size_t i) {
    const Eigen::Vector3d direction = directions_[i].cast<double>();
    Colour light = Colour::Zero();
    for (const SE3& T : poses) {
      const auto hit = world_.cast(T.p, (T.R * direction).normalized());
      light += hit ? world_.radiance(*hit, pixel_angle) : world_.sky();
    }
    std::uint64_t bits = Random(config_.seed, stream + 1, static_cast<std::uint64_t>(index) * 10'000'019 + i).bits();
    for (std::size_t c = 0; c < 3; ++c, bits >>= 12) {
      const float grey = brightness * light[static_cast<int>(c)];
      const float noisy = grey + std::sqrt(read + photon * grey) * gaussian_[bits % draws];
      out.pixels[3 * i + c] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5F, 0.0F, 255.0F));
    }
  };
  workers.sum(directions_.size(), 4 * static_cast<std::size_t>(m.width), NoSum{}, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) expose(i);
    return NoSum{};
  });
  return out;
}

}  // namespace kilvo::lab
