// Voxel downsampling that loses no information: all points of a cell become one group with their number, mean and scatter.
#pragma once

#include <span>
#include <vector>

#include "kilvo/lidar/undistort.hpp"

namespace kilvo {

struct PointCluster {
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();  // IMU frame, m
  float count = 0;
  // Upper triangle of the scatter matrix, sum of (x - mean)(x - mean)': xx xy xz yy yz zz, m^2
  Eigen::Matrix<float, 6, 1> scatter = Eigen::Matrix<float, 6, 1>::Zero();

  Eigen::Matrix3f scatter_matrix() const {
    Eigen::Matrix3f S;
    S << scatter[0], scatter[1], scatter[2], scatter[1], scatter[3], scatter[4], scatter[2], scatter[4], scatter[5];
    return S;
  }
};

/// Groups points (IMU frame) by the cells of the world's grid that they fall into at the pose T_WI; in order of first appearance. Two
/// cells whose means are both within `reach` (m) of their common face become one: a surface along a face is not cut in two by its noise.
std::vector<PointCluster> downsample(std::span<const PointXYZI> points, const SE3& T_WI, double cell, double reach = 0);

}  // namespace kilvo
