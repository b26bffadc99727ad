#include "kilvo/map/visual_map.hpp"

#include <algorithm>

namespace kilvo {
namespace {

// A point that so many images in a row disagree with is no point of a surface, or has changed.
constexpr std::uint16_t most_failures = 5;
// How fast the agreement of an observation follows the images.
constexpr float agreement_share = 0.2F;

template <class T>
std::uint32_t place(std::vector<T>& pool, std::vector<std::uint32_t>& free, const T& value) {
  if (free.empty()) {
    pool.push_back(value);
    return static_cast<std::uint32_t>(pool.size() - 1);
  }
  const std::uint32_t i = free.back();
  free.pop_back();
  pool[i] = value;
  return i;
}

}  // namespace

std::size_t VisualMap::memory_bytes() const {
  return points_.capacity() * (sizeof(VisualPoint) + sizeof(VoxelKey)) + observations_.capacity() * sizeof(Observation) +
         frames_.capacity() * sizeof(VisualFrame) + voxels_.capacity() * 2 * sizeof(VoxelKey);
}

std::uint32_t VisualMap::add_frame(const VisualFrame& frame) { return place(frames_, free_frames_, frame); }

void VisualMap::forget_unused_frame(std::uint32_t frame) {
  if (frames_[frame].observations == 0) free_frames_.push_back(frame);
}

bool VisualMap::insert(const VisualPoint& point, const Observation& first) {
  const VoxelKey key = key_of(point.p_W);
  int there = 0;
  visit(key, [&there](std::uint32_t, const VisualPoint&) { ++there; });
  if (there >= config_.per_voxel) return false;
  const std::uint32_t i = place(points_, free_points_, point);
  keys_.resize(points_.size());
  keys_[i] = key;
  VisualPoint& p = points_[i];
  p.used = true;
  p.count = 1;
  p.observations[0] = place(observations_, free_observations_, first);
  ++frames_[first.frame].observations;
  p.next = voxels_.find(key);
  if (p.next != no_index) voxels_.erase(key);
  voxels_.insert(key, i);
  ++size_;
  return true;
}

void VisualMap::observe(std::uint32_t point, const Observation& view) {
  VisualPoint& p = points_[point];
  if (p.count == VisualPoint::most_observations) {
    const auto worst = std::min_element(p.observations.begin() + 1, p.observations.end(), [this](std::uint32_t a, std::uint32_t b) {
      return observations_[a].agreement < observations_[b].agreement;
    });
    release(*worst);
    std::copy(worst + 1, p.observations.end(), worst);
    --p.count;
  }
  p.observations[p.count++] = place(observations_, free_observations_, view);
  ++frames_[view.frame].observations;
}

void VisualMap::refresh(std::uint32_t point, const Eigen::Vector3d& p_W, const Eigen::Vector3f& normal_W, float variance,
                        std::uint32_t node) {
  VisualPoint& p = points_[point];
  p.p_W = p_W;
  p.normal_W = normal_W;
  p.variance = variance;
  p.node = node;
}

void VisualMap::judge(std::uint32_t point, std::uint32_t observation, bool agreed, float correlation) {
  VisualPoint& p = points_[point];
  Observation& o = observations_[observation];
  o.agreement += agreement_share * (correlation - o.agreement);
  if (agreed) {
    p.seen = static_cast<std::uint16_t>(std::min<int>(p.seen + 1, 1000));
    p.failed = 0;
  } else if (++p.failed >= most_failures) {
    remove(point);
  }
}

void VisualMap::release(std::uint32_t observation) {
  const std::uint32_t frame = observations_[observation].frame;
  if (--frames_[frame].observations == 0) free_frames_.push_back(frame);
  free_observations_.push_back(observation);
}

void VisualMap::unlink(std::uint32_t point) {
  const VoxelKey key = keys_[point];
  const std::uint32_t head = voxels_.find(key);
  if (head == point) {
    voxels_.erase(key);
    if (points_[point].next != no_index) voxels_.insert(key, points_[point].next);
    return;
  }
  std::uint32_t i = head;
  while (points_[i].next != point) i = points_[i].next;
  points_[i].next = points_[point].next;
}

void VisualMap::remove(std::uint32_t point) {
  unlink(point);
  VisualPoint& p = points_[point];
  for (std::size_t k = 0; k < p.count; ++k) release(p.observations[k]);
  p = VisualPoint{};
  free_points_.push_back(point);
  --size_;
}

void VisualMap::forget(const Eigen::Vector3d& centre, double radius) {
  const auto most = static_cast<std::size_t>(config_.max_points);
  // A tenth more than is wanted goes at once, so that this is rare.
  double limit2 = radius * radius;
  if (size_ > most) {
    std::vector<double> distances2;
    distances2.reserve(size_);
    for (const VisualPoint& p : points_) {
      if (p.used) distances2.push_back((p.p_W - centre).squaredNorm());
    }
    const auto kept = distances2.begin() + static_cast<std::ptrdiff_t>(most - most / 10);
    std::nth_element(distances2.begin(), kept, distances2.end());
    limit2 = std::min(limit2, *kept);
  }
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    if (points_[i].used && (points_[i].p_W - centre).squaredNorm() > limit2) remove(i);
  }
}

}  // namespace kilvo
