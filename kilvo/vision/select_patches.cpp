#include "kilvo/vision/select_patches.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace kilvo {
namespace {

// Views that differ by more show another picture, rad.
constexpr double most_turned = 0.7;

std::vector<VoxelKey> voxels_in_view(const VisualMap& map, const DepthView& depth) {
  std::vector<VoxelKey> keys;
  // Most points lie in a voxel that was met a moment ago: those need not be sorted.
  constexpr std::size_t recent = 256;
  std::array<VoxelKey, recent> met;
  met.fill(~VoxelKey{0});
  for (const DepthView::Seen& s : depth.seen()) {
    const VoxelKey key = map.key_of(depth.point(s));
    VoxelKey& last = met[(key * 0x9E3779B97F4A7C15ULL >> 32) % recent];
    if (last == key) continue;
    last = key;
    keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

struct View {
  const VisualMap& map;
  const Camera& camera;
  const SE3& T_CW;
  Eigen::Vector3d eye_W;
};

// The observation whose view is most like this one; of those that are alike, the oldest, which has drifted least.
bool choose_observation(const View& view, const VisualPoint& p, PatchCandidate& track) {
  const Eigen::Vector3d towards = view.eye_W - p.p_W;
  const double distance = towards.norm();
  double best = 1e9;
  for (std::size_t k = 0; k < p.count; ++k) {
    const Observation& o = view.map.observation(p.observations[k]);
    const SE3& T_RW = view.map.frame(o.frame).T_CW;
    const Eigen::Vector3d from = -(T_RW.R.inverse() * T_RW.p) - p.p_W;
    const double reference = from.norm();
    const double angle = std::acos(std::clamp(from.dot(towards) / (reference * distance), -1.0, 1.0));
    if (angle > most_turned) continue;
    const double octaves = std::abs(std::log2(reference / distance));
    const double unlike =
        std::max(0.0, octaves - alike_scale) + std::max(0.0, angle - alike_angle) + 2 * (1 - static_cast<double>(o.agreement));
    if (unlike >= best) continue;
    best = unlike;
    track.observation = p.observations[k];
    track.view_angle = angle;
  }
  if (best >= 1e9) return false;
  const SE3& T_RW = view.map.frame(view.map.observation(track.observation).frame).T_CW;
  const auto warp = warp_between(view.camera, view.T_CW, T_RW, p.p_W, p.normal_W.cast<double>());
  if (warp) track.warp = *warp;
  return warp.has_value();
}

// A point that the image should show, with its expected value.
struct Candidate {
  std::size_t cell;
  double worth, depth;
  std::uint32_t point;
  Eigen::Vector2d pixel;
};

// What is to be looked at, if it can be.
std::optional<PatchCandidate> track_of(const View& view, const DepthView& depth, const VisionConfig& config, const Candidate& candidate) {
  const VisualPoint& p = view.map.point(candidate.point);
  const Eigen::Vector3d n = p.normal_W.cast<double>(), towards = view.eye_W - p.p_W;
  const double facing = n.dot(towards);
  if (std::abs(facing) < grazing * towards.norm()) return std::nullopt;
  if (depth.hides(candidate.pixel, p.p_W, facing > 0 ? n : Eigen::Vector3d(-n), candidate.depth)) return std::nullopt;
  PatchCandidate track;
  track.point = candidate.point;
  track.plain = static_cast<double>(p.corner) < config.min_corner;
  track.pixel = candidate.pixel;
  return choose_observation(view, p, track) ? std::optional(track) : std::nullopt;
}

}  // namespace

std::optional<PlaneWarp> warp_between(const Camera& camera, const SE3& T_CW, const SE3& T_RW, const Eigen::Vector3d& p_W,
                                      const Eigen::Vector3d& n_W) {
  const auto here = camera.project_with_jacobian(T_CW * p_W), there = camera.project_with_jacobian(T_RW * p_W);
  if (!here || !there) return std::nullopt;
  Eigen::Matrix<double, 3, 2> along;  // the plane
  along.col(0) = n_W.unitOrthogonal();
  along.col(1) = n_W.cross(along.col(0));
  const Eigen::Matrix2d B = here->J * T_CW.R.matrix() * along;
  constexpr double edge_on = 1e-3;  // px^2/m^2
  if (std::abs(B.determinant()) < edge_on) return std::nullopt;
  PlaneWarp out;
  out.A = there->J * T_RW.R.matrix() * along * B.inverse();
  // How deep the plane lies in the other view, over how deep in this one, by the pixel of this one.
  const Eigen::Vector3d p_C = T_CW * p_W, p_R = T_RW * p_W;
  constexpr double flat = 0.1;  // of a wide lens: beyond it depth has little effect
  if (p_C.z() < flat * p_C.norm() || p_R.z() < flat * p_R.norm()) return out;
  const SE3 T_RC = T_RW * T_CW.inverse();
  const Eigen::Vector3d n_C = T_CW.R * n_W;
  const Eigen::Vector3d ratio_by_ray = T_RC.R.matrix().row(2).transpose() + n_C * (T_RC.p.z() / n_C.dot(p_C));
  const Eigen::Matrix2d ray_by_pixel = (here->J.leftCols<2>() * p_C.z()).inverse();
  out.c = ray_by_pixel.transpose() * ratio_by_ray.head<2>() * (p_C.z() / p_R.z());
  return out;
}

std::vector<PatchCandidate> select_patches(const VisualMap& map, const Camera& camera, const SE3& T_CW, const DepthView& depth,
                                           const VisionConfig& config) {
  const View view{map, camera, T_CW, T_CW.inverse().p};
  const CellGrid grid(camera, config.cell);
  std::vector<Candidate> candidates;
  for (const VoxelKey key : voxels_in_view(map, depth)) {
    map.visit(key, [&](std::uint32_t id, const VisualPoint& p) {
      const Eigen::Vector3d p_C = T_CW * p.p_W;
      const auto pixel = camera.project(p_C);
      if (!pixel || !camera.sees(*pixel, border_at(1))) return;
      // Those that have proven themselves first.
      const double worth = static_cast<double>(p.corner) * (1.0 + std::min<int>(p.seen, 10)) / (1.0 + p.failed);
      for (std::size_t k = 0; k < p.count; ++k) __builtin_prefetch(&map.observation(p.observations[k]));
      if (worth > 0) candidates.push_back({grid.of(*pixel), worth, p_C.z(), id, *pixel});
    });
  }
  std::ranges::stable_sort(candidates, {}, [](const Candidate& c) { return std::pair(c.cell, -c.worth); });
  std::vector<PatchCandidate> tracks;
  std::size_t taken = grid.size();
  for (const Candidate& candidate : candidates) {
    if (candidate.cell == taken) continue;
    // A point without a usable view must not keep others out of its cell.
    const auto track = track_of(view, depth, config, candidate);
    if (!track) continue;
    tracks.push_back(*track);
    taken = candidate.cell;
  }
  const std::size_t corners = tracks.size() - static_cast<std::size_t>(std::ranges::count_if(tracks, &PatchCandidate::plain));
  if (corners >= plenty_of_corners) std::erase_if(tracks, [](const PatchCandidate& t) { return t.plain; });
  return tracks;
}

}  // namespace kilvo
