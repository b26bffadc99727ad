#include "lab/doctor/camera_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "kilvo/math/decompositions.hpp"
#include "kilvo/vision/camera.hpp"
#include "lab/doctor/turns.hpp"

namespace kilvo::lab {
namespace {

constexpr std::size_t fewest_tracks = 10;  // of a pair
constexpr std::size_t most_pairs = 160;
constexpr double camera_slack = 0.06;      // s, at both ends of the gyro's path
constexpr double least_image_way = 0.012;  // m between images, below which the direction is not known
constexpr double near_epipole = 0.08;      // sine

// Rotations that lie evenly among all, some 15 degrees apart (Alexa: Super-Fibonacci Spirals, CVPR 2022).
std::vector<SO3> even_rotations() {
  constexpr int count = 1500;
  constexpr double phi = 1.4142135623730951, psi = 1.5337511687552043;
  std::vector<SO3> out;
  for (int i = 0; i < count; ++i) {
    const double s = i + 0.5, turn = 2 * std::numbers::pi * s, r = std::sqrt(s / count), R = std::sqrt(1 - s / count);
    out.push_back(
        SO3::from_quaternion({R * std::cos(turn / psi), r * std::sin(turn / phi), r * std::cos(turn / phi), R * std::sin(turn / psi)}));
  }
  return out;
}

// px: a mean that some outliers do not move. In units of a pixel of the image, not of the guess: a shorter focal length must not look
// better.
double typical(const Residuals& r) {
  double sum = 0;
  for (const double e : r.r) sum += std::log1p(e * e);
  return std::sqrt(std::expm1(sum / static_cast<double>(r.groups())));
}

double clamp_px(double e) { return std::clamp(e, -200.0, 200.0); }

// The direction of the way that fits all tracks of a pair best.
Eigen::Vector3d direction_of(const std::vector<Eigen::Vector3d>& normals) {
  Eigen::Vector3d t = Eigen::Vector3d::UnitZ();
  double scale = 0.01;
  for (int k = 0; k < 3; ++k) {
    Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& n : normals) {
      const double e = k == 0 ? 0 : t.dot(n);
      S += n * n.transpose() / (1 + e * e / (scale * scale));
    }
    t = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(S).eigenvectors().col(0);
    scale = 0.003;
  }
  return t;
}

// Of the principal point in focal lengths, and of the logarithm of fy / fx.
constexpr double lens_prior = 0.5;

// See CameraFit.
CameraMount with_lens(const CameraMount& mount, const Eigen::VectorXd& lens) {
  CameraMount out = mount;
  out.cx += lens[0] * mount.fx;
  out.cy += lens[1] * mount.fy;
  out.fy *= std::exp(lens[2]);
  if (out.distortion.empty()) out.distortion.resize(4, 0);
  out.distortion[0] += lens[3];
  out.distortion[1] += lens[4];
  return out;
}

}  // namespace

CameraTracks::CameraTracks(const std::vector<TrackedPair>& tracks, const GyroPath& gyro, const LidarWay* way) : gyro_(gyro), way_(way) {
  std::vector<const TrackedPair*> all;
  for (const TrackedPair& pair : tracks) {
    if (pair.tracks.size() >= fewest_tracks && pair.to - pair.from < 0.4 && gyro.covers(pair.from - camera_slack, pair.to + camera_slack))
      all.push_back(&pair);
  }
  // The pairs that turned most say most; of those an even choice in time.
  std::vector<double> turns;
  for (const TrackedPair* p : all) turns.push_back(gyro.rate(p->from, p->to).norm());
  std::vector<double> sorted = turns;
  std::ranges::sort(sorted);
  const double least = sorted.size() > most_pairs ? sorted[sorted.size() - most_pairs] : 0;
  double sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (turns[i] < least || pairs_.size() >= most_pairs) continue;
    pairs_.push_back(all[i]);
    sum += turns[i] * turns[i];
  }
  if (!pairs_.empty()) turning_ = std::sqrt(sum / static_cast<double>(pairs_.size()));
}

std::vector<std::vector<Eigen::Vector4d>> CameraTracks::rays_of(const CameraMount& mount) const {
  std::vector<std::vector<Eigen::Vector4d>> out;
  const Camera camera(mount);
  for (const TrackedPair* pair : pairs_) {
    std::vector<Eigen::Vector4d> rays;
    for (const Track& track : pair->tracks) {
      const auto a = camera.unproject(track.from.cast<double>()), b = camera.unproject(track.to.cast<double>());
      // The same number of tracks under every guess: what has no ray looks along the axis, and fits nothing.
      rays.push_back(a && b ? Eigen::Vector4d(a->x(), a->y(), b->x(), b->y()) : Eigen::Vector4d(0, 0, 1, 1));
    }
    out.push_back(std::move(rays));
  }
  return out;
}

void CameraTracks::residuals(const CameraGuess& guess, const std::vector<std::vector<Eigen::Vector4d>>& rays, const SE3& T_IC, double focal,
                             double offset, std::size_t stride, Residuals& out) const {
  out.width = 1;
  const double px = 0.5 * (guess.mount.fx + guess.mount.fy) * focal;
  std::vector<Eigen::Vector3d> normals, first;
  for (std::size_t i = 0; i < pairs_.size(); i += stride) {
    const double a = pairs_[i]->from + offset, b = pairs_[i]->to + offset;
    const SO3 R_12 = T_IC.R.inverse() * SO3::from_quaternion(gyro_.between(a, b)) * T_IC.R;
    normals.clear(), first.clear();
    for (const Eigen::Vector4d& ray : rays[i]) {
      const Eigen::Vector3d u = Eigen::Vector3d(ray[0] / focal, ray[1] / focal, 1).normalized();
      const Eigen::Vector3d w = R_12 * Eigen::Vector3d(ray[2] / focal, ray[3] / focal, 1).normalized();
      first.push_back(u);
      normals.push_back(u.cross(w));
    }
    Eigen::Vector3d t = Eigen::Vector3d::Zero();
    if (way_ != nullptr && !way_->empty()) {
      const auto A = way_->at(a, gyro_), B = way_->at(b, gyro_);
      if (A && B) t = ((*A * T_IC).inverse() * (*B * T_IC)).p;
    }
    const bool known = t.norm() > least_image_way;
    t = known ? Eigen::Vector3d(t.normalized()) : direction_of(normals);
    for (std::size_t k = 0; k < normals.size(); ++k) {
      const double sine = std::max(t.cross(first[k]).norm(), near_epipole);
      out.r.push_back(clamp_px(px * t.dot(normals[k]) / sine));
      out.block.push_back(static_cast<int>(pairs_[i]->from / block_seconds));
    }
  }
}

double CameraTracks::error(const CameraGuess& guess) const {
  try {
    Residuals r;
    residuals(guess, rays_of(guess.mount), guess.mount.T_imu_camera, 1, guess.offset, std::max<std::size_t>(1, pairs_.size() / 60), r);
    if (r.groups() < 300) return INFINITY;
    return typical(r);
  } catch (const std::invalid_argument&) {
    return INFINITY;
  }
}

CameraFit CameraTracks::fit(const CameraGuess& guess, bool with_focal, bool with_offset) const {
  return fit(guess, Free{with_focal, with_offset, false});
}

// Once more from where the first fit ended: a position means another thing with another rotation and focal length.
CameraFit CameraTracks::fit_with_position(const CameraGuess& guess) const {
  const CameraFit first = fit(guess, Free{true, true, true});
  if (!first.fit.good) return first;
  CameraFit out = fit({first.mount, first.offset}, Free{true, true, true});
  out.focal *= first.focal;
  return out;
}

// The same: a distortion means another thing with another focal length.
CameraFit CameraTracks::fit_with_lens(const CameraGuess& guess) const {
  const CameraFit first = fit(guess, Free{true, true, false, true});
  return first.fit.good ? fit({first.mount, first.offset}, Free{true, true, false, true}) : first;
}

CameraFit CameraTracks::fit(const CameraGuess& guess, const Free& free) const {
  CameraFit out;
  out.R_IC = guess.mount.T_imu_camera.R;
  out.p_IC = guess.mount.T_imu_camera.p;
  out.offset = guess.offset;
  std::vector<std::vector<Eigen::Vector4d>> rays;
  try {
    rays = rays_of(guess.mount);
  } catch (const std::invalid_argument&) {
    return out;
  }
  const SE3& described = guess.mount.T_imu_camera;
  const auto mount_at = [&](const Eigen::VectorXd& x) {
    return SE3{described.R * SO3::Exp(x.head<3>()), free.position ? Eigen::Vector3d(described.p + x.tail<3>()) : described.p};
  };
  Eigen::VectorXd lens = Eigen::VectorXd::Zero(5);
  const auto rows = [&](const Eigen::VectorXd& x, Residuals& r) {
    // Other rays only where the lens is another one.
    if (free.lens && x.tail<5>() != lens) {
      lens = x.tail<5>();
      rays = rays_of(with_lens(guess.mount, lens));
    }
    residuals(guess, rays, mount_at(x), std::exp(std::clamp(x[3], -2.0, 2.0)), guess.offset + std::clamp(x[4], -camera_slack, camera_slack),
              1, r);
  };
  const int parameters = free.position ? 8 : free.lens ? 10 : 5;
  Eigen::VectorXd start = Eigen::VectorXd::Zero(parameters), prior = Eigen::VectorXd::Ones(parameters),
                  step = Eigen::VectorXd::Constant(parameters, 1e-3);
  const double turn = free.rotation ? INFINITY : 1e-6;
  prior.head<5>() << turn, turn, turn, free.focal ? 1.0 : 1e-6, free.offset ? 1.0 : 1e-7;
  step[4] = 5e-4;
  if (free.lens) prior.tail<5>() << lens_prior, lens_prior, lens_prior, 1, 1;
  try {
    out.fit = robust_fit(rows, start, prior, step, 8);
  } catch (const std::invalid_argument&) {
    return out;  // the search left what a lens can be
  }
  if (!out.fit.good) return out;
  const SE3 found = mount_at(out.fit.x);
  out.R_IC = found.R;
  out.p_IC = found.p;
  out.focal = std::exp(out.fit.x[3]);
  out.offset = guess.offset + out.fit.x[4];
  out.mount = free.lens ? with_lens(guess.mount, out.fit.x.tail<5>()) : guess.mount;
  out.mount.T_imu_camera = found;
  out.mount.fx *= out.focal;
  out.mount.fy *= out.focal;
  out.error = out.fit.scale;
  return out;
}

CameraFit CameraTracks::fit_any_rotation(const CameraGuess& guess) const {
  constexpr std::size_t looked_at = 25, refined = 10;  // pairs of images, rotations
  std::vector<std::vector<Eigen::Vector4d>> rays;
  try {
    rays = rays_of(guess.mount);
  } catch (const std::invalid_argument&) {
    return {};
  }
  std::vector<std::pair<double, SO3>> starts;
  for (const SO3& R : even_rotations()) {
    Residuals r;
    residuals(guess, rays, {R, guess.mount.T_imu_camera.p}, 1, guess.offset, std::max<std::size_t>(1, pairs_.size() / looked_at), r);
    starts.emplace_back(typical(r), R);
  }
  std::ranges::sort(starts, {}, [](const auto& start) { return start.first; });
  CameraFit best;
  double least = INFINITY;
  for (std::size_t i = 0; i < refined; ++i) {
    CameraGuess start = guess;
    start.mount.T_imu_camera.R = starts[i].second;
    const CameraFit found = fit(start, false, false);
    start.mount.T_imu_camera.R = found.R_IC;
    const double error = this->error(start);
    if (!found.fit.good || error >= least) continue;
    least = error;
    best = found;
  }
  // From so far away the first fit ends some tenths of a degree too early.
  CameraGuess near = guess;
  near.mount.T_imu_camera.R = best.R_IC;
  return best.fit.good ? fit(near, false, false) : best;
}

std::vector<double> CameraTracks::likely_offsets(double reach) const {
  // Mean motion of the tracks, whatever the calibration: its length against the gyro's.
  std::vector<Turn> turns;
  for (const TrackedPair* pair : pairs_) {
    std::vector<float> lengths;
    for (const Track& t : pair->tracks) lengths.push_back((t.to - t.from).norm());
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::ranges::nth_element(lengths, middle);
    turns.push_back({pair->from, pair->to, {Eigen::Vector3d(static_cast<double>(*middle), 0, 0), Eigen::Vector3d::Zero()}, 1});
  }
  return kilvo::lab::likely_offsets(turns, gyro_, reach);
}

}  // namespace kilvo::lab
