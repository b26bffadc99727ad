#include "lab/simulation/camera_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "lab/simulation/no_sum.hpp"
#include "lab/simulation/random.hpp"

namespace kilvo::lab {
namespace {

using std::numbers::pi;
constexpr std::uint64_t image_stream = 41;
constexpr std::size_t draws = 4096;  // of the noise table: 12 bits choose one

// A pixel at an edge is seen by rays, at these quantiles of the Gaussian that blurs; what their number leaves out is in each of them. None
// is a pixel away: so a pixel whose neighbours see what it sees needs none.
constexpr std::array quantiles{-1.15, -0.32, 0.32, 1.15};
constexpr double blur_of_ray = 0.53;

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
  for (int v = -1; v <= m.height; ++v) {
    for (int u = -1; u <= m.width; ++u) directions_.emplace_back(unproject(m, {u, v}).cast<float>());
  }
  Random random(config.seed, image_stream);
  double sum = 0, squares = 0;
  std::vector<double> table(draws);
  for (double& x : table) x = random.gaussian(), sum += x;
  for (double& x : table) x -= sum / draws, squares += x * x;
  for (const double x : table) gaussian_.push_back(static_cast<float>(x / std::sqrt(squares / draws)));
}

PixelRay CameraSensor::ray_of(int u, int v, const SO3& R_WC) const {
  const auto at = [&](int x, int y) {
    return directions_[static_cast<std::size_t>(y + 1) * static_cast<std::size_t>(config_.camera.width + 2) +
                       static_cast<std::size_t>(x + 1)]
        .cast<double>();
  };
  return {(R_WC * Eigen::Vector3d(at(u, v))).normalized(), R_WC * Eigen::Vector3d((at(u + 1, v) - at(u - 1, v)) / 2),
          R_WC * Eigen::Vector3d((at(u, v + 1) - at(u, v - 1)) / 2)};
}

Colour CameraSensor::light_of_edge(const Eigen::Vector3d& origin, const PixelRay& ray) const {
  // A grid turned a little: along an edge in any of the usual directions each ray counts by itself.
  constexpr double c = 0.970, s = 0.243;
  const double blur = config_.camera.blur;
  std::array<Eigen::Vector3d, World::bundle> directions;
  static_assert(quantiles.size() * quantiles.size() == World::bundle);
  auto next = directions.begin();
  for (const double a : quantiles) {
    for (const double b : quantiles) {
      const double x = blur * a, y = blur * b;
      *next++ = (ray.direction + (c * x - s * y) * ray.right + (s * x + c * y) * ray.down).normalized();
    }
  }
  const auto hits = world_.cast(origin, directions);
  Colour light = Colour::Zero();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    light += hits[i] ? world_.radiance(*hits[i], {directions[i], ray.right, ray.down}, blur_of_ray * blur) : world_.sky();
  }
  return light / static_cast<float>(World::bundle);
}

// Adds what the rows of pixels from `first_row` to before `last_row` see.
void CameraSensor::add_light(const SE3& T_WC, int first_row, int last_row, std::vector<Colour>& light) const {
  constexpr std::size_t sky = ~std::size_t{0};
  const int width = config_.camera.width;
  const auto columns = static_cast<std::size_t>(width) + 2;
  std::vector<std::size_t> seen;  // surfaces, of one pixel more on each side
  std::vector<std::optional<Hit>> hits;
  for (int v = first_row - 1; v <= last_row; ++v) {
    const Eigen::Vector3f* row = &directions_[static_cast<std::size_t>(v + 1) * columns];
    for (std::size_t first = 0; first < columns; first += World::bundle) {
      std::array<Eigen::Vector3d, World::bundle> directions;
      for (std::size_t k = 0; k < World::bundle; ++k)
        directions[k] = (T_WC.R * row[std::min(first + k, columns - 1)].cast<double>()).normalized();
      const auto bundle = world_.cast(T_WC.p, directions);
      hits.insert(hits.end(), bundle.begin(), bundle.begin() + static_cast<std::ptrdiff_t>(std::min(World::bundle, columns - first)));
    }
  }
  for (const auto& hit : hits) seen.push_back(hit ? hit->surface : sky);
  const auto is_edge = [&](std::size_t i) {
    for (const std::size_t row : {i - columns, i, i + columns}) {
      if (seen[row - 1] != seen[i] || seen[row] != seen[i] || seen[row + 1] != seen[i]) return true;
    }
    return false;
  };
  // Half of what lies between two pixels' places on the surface that both see.
  const auto between = [&](std::size_t a, std::size_t b) {
    return Eigen::Vector2d((hits[b]->u - hits[a]->u) / 2, (hits[b]->v - hits[a]->v) / 2);
  };
  const auto light_at = [&](int u, int v, std::size_t i) -> Colour {
    if (is_edge(i)) return light_of_edge(T_WC.p, ray_of(u, v, T_WC.R));
    if (!hits[i]) return world_.sky();
    return world_.radiance(*hits[i], between(i - 1, i + 1), between(i - columns, i + columns), config_.camera.blur);
  };
  auto out = light.begin();
  for (int v = first_row; v < last_row; ++v) {
    std::size_t i = static_cast<std::size_t>(v - first_row + 1) * columns;
    for (int u = 0; u < width; ++u) *out++ += light_at(u, v, ++i);
  }
}

// Grey levels of the pixels from `first` on. `brightness`: of full reflectance, by colour.
void CameraSensor::expose(std::int64_t index, const Colour& brightness, std::size_t first, const std::vector<Colour>& light,
                          Image& out) const {
  const CameraModel& m = config_.camera;
  const auto& errors = config_.errors.camera;
  const auto read = static_cast<float>(m.read_noise * m.read_noise), photon = static_cast<float>(m.photon_noise);
  const Eigen::Vector2d middle(m.cx, m.cy);
  for (std::size_t k = 0; k < light.size(); ++k) {
    const std::size_t i = first + k, width = static_cast<std::size_t>(m.width);
    const Eigen::Vector2d pixel(static_cast<double>(i % width), static_cast<double>(i / width));
    const float shade = errors ? errors->shade((pixel - middle).squaredNorm() / middle.squaredNorm()) : 1;
    std::uint64_t bits = Random(config_.seed, image_stream + 1, static_cast<std::uint64_t>(index) * 10'000'019 + i).bits();
    for (std::size_t c = 0; c < 3; ++c, bits >>= 12) {
      const float grey = shade * brightness[static_cast<int>(c)] * light[k][static_cast<int>(c)];
      const float linear = grey + std::sqrt(read + photon * grey) * gaussian_[bits % draws];
      const float noisy = errors ? errors->response(linear) : linear;
      out.pixels[3 * i + c] = static_cast<std::uint8_t>(std::clamp(noisy + 0.5F, 0.0F, 255.0F));
    }
  }
}

// How many looks within the exposure it takes for what the image turns by.
int CameraSensor::samples_of(double t, double exposure, const std::function<SE3(double)>& torso_at) const {
  const CameraModel& m = config_.camera;
  if (m.pixels_per_sample <= 0) return std::max(1, m.blur_samples);
  const double angle = (torso_at(t - exposure / 2).R.inverse() * torso_at(t + exposure / 2).R).Log().norm();
  return 1 + static_cast<int>(std::min(7.0, angle * m.fx / m.pixels_per_sample));
}

Image CameraSensor::image(std::int64_t index, double t, const std::function<SE3(double)>& torso_at, const Workers& workers) const {
  const CameraModel& m = config_.camera;
  const auto& errors = config_.errors.camera;
  const double exposure = exposure_at(m, t), readout = errors ? errors->readout : 0;
  const int samples = samples_of(t, exposure, torso_at);
  Colour brightness = Colour::Constant(static_cast<float>(255 * exposure * m.gain / samples));
  if (errors) brightness = brightness.cwiseProduct(Eigen::Map<const Colour>(errors->tint(t).data()));
  const auto width = static_cast<std::size_t>(m.width), height = static_cast<std::size_t>(m.height);

  Image out{m.width, m.height, 3, std::vector<std::uint8_t>(width * height * 3)};
  // Rows that are read out after each other are seen from one place each few of them: 0.1 ms, some hundredths of a pixel.
  const std::size_t rows = readout > 0 ? 4 : 48;
  workers.sum(height, rows, NoSum{}, [&](std::size_t first, std::size_t last) {
    const double middle = t + readout * (static_cast<double>(first + last) / 2 / m.height - 0.5);
    std::vector<Colour> light((last - first) * width, Colour::Zero());
    for (int k = 0; k < samples; ++k) {
      const SE3 T_WC = torso_at(middle + exposure * ((k + 0.5) / samples - 0.5)) * m.T_torso_camera;
      add_light(T_WC, static_cast<int>(first), static_cast<int>(last), light);
    }
    expose(index, brightness, first * width, light, out);
    return NoSum{};
  });
  return out;
}

}  // namespace kilvo::lab
