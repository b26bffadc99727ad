// Points worth remembering: corners of an image that lie on planes of the map.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "kilvo/map/visual_map.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/depth_view.hpp"
#include "kilvo/vision/pyramid.hpp"
#include "kilvo/vision/select_patches.hpp"
#include "kilvo/vision/vision_config.hpp"

namespace kilvo {

struct NewPoint {
  VisualPoint point;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// The best corner of each cell of the image that has no track, where the ray of its pixel meets the plane of the LiDAR point seen there;
/// where there are few of them, some plain patches as well.
std::vector<NewPoint> new_points(const VoxelMap& map, const Camera& camera, const SE3& T_CW, const GreyImage& image, const DepthView& depth,
                                 std::span<const PatchCandidate> tracks, const VisionConfig& config);

/// Puts a point onto the plane that the map has there now, along the ray from `eye_W`. False when there is none near.
bool project_to_plane(const VoxelMap& map, const Eigen::Vector3d& eye_W, VisualPoint& point);

}  // namespace kilvo
