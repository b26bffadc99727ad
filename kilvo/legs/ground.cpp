#include "kilvo/legs/ground.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

const double steepest = std::cos(30 * M_PI / 180);
// A contact that is so far from the plane of the others began another piece of ground, m.
constexpr double same_ground = 0.02;
// Contacts themselves, m.
constexpr double contact_sigma = 0.005;
// Prior sigma of the slope across the direction of walking, which the feet barely measure.
constexpr double slope_sigma = 0.1;

}  // namespace

std::optional<GroundPatch> GroundLookup::of_map(const VoxelMap& map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W) {
  std::optional<GroundPatch> best;
  double nearest = stair;  // a foot seems to be above or below its own plane by what was drifted meanwhile
  // The floor may lie just beyond the boundary of the voxel that holds the foot.
  for (const double offset : {0.0, stair, -stair}) {
    map.visit_planes(p_W + offset * up_W, [&](const VoxelMap::Match& match) {
      const Plane& plane = *match.plane;
      const Eigen::Vector3d normal = plane.normal.cast<double>().normalized();
      const double rise = normal.dot(up_W), distance = std::abs(plane.distance(p_W));
      if (std::abs(rise) < steepest || distance >= nearest) return false;
      nearest = distance;
      best = GroundPatch{rise > 0 ? normal : Eigen::Vector3d(-normal), plane.centre,
                         std::sqrt(plane.variance_at(p_W) + static_cast<double>(plane.roughness_variance))};
      return false;
    });
  }
  return best;
}

// Height over the newest contact as a linear function of the horizontal offset from it: least squares with a level prior, which is the
// anchor where one or two contacts leave the tilt open.
std::optional<GroundPatch> GroundLookup::of_contacts(const Eigen::Vector3d& up_W) const {
  if (count_ == 0) return std::nullopt;
  const Eigen::Vector3d a = up_W.unitOrthogonal(), b = up_W.cross(a);
  const Eigen::Vector3d& newest = contacts_[(count_ - 1) % memory];
  Eigen::Matrix3d A = Eigen::Vector3d(0, 1 / (slope_sigma * slope_sigma), 1 / (slope_sigma * slope_sigma)).asDiagonal();
  Eigen::Vector3d y = Eigen::Vector3d::Zero(), fit = Eigen::Vector3d::Zero();
  for (std::size_t back = 0; back < std::min(count_, memory); ++back) {
    const Eigen::Vector3d d = contacts_[(count_ - 1 - back) % memory] - newest;
    const Eigen::Vector3d row(1, a.dot(d), b.dot(d));
    // Contacts before a change of slope do not describe the ground ahead.
    if (back > 2 && std::abs(up_W.dot(d) - row.dot(fit)) > same_ground) break;
    A += row * row.transpose() / (contact_sigma * contact_sigma);
    y += row * up_W.dot(d) / (contact_sigma * contact_sigma);
    fit = A.ldlt().solve(y);
  }
  const Eigen::Vector3d normal = (up_W - fit[1] * a - fit[2] * b).normalized();
  if (normal.dot(up_W) < steepest) return GroundPatch{up_W, newest, same_ground};
  return GroundPatch{normal, newest + fit[0] * up_W, contact_sigma};
}

std::optional<GroundPatch> GroundLookup::under(const VoxelMap* map, const Eigen::Vector3d& p_W, const Eigen::Vector3d& up_W) const {
  if (map != nullptr) {
    if (auto patch = of_map(*map, p_W, up_W)) return patch;
  }
  return of_contacts(up_W);
}

void GroundLookup::stands_at(const Eigen::Vector3d& p_W) { contacts_[count_++ % memory] = p_W; }

}  // namespace kilvo
