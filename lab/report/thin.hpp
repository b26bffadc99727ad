// As much of a series as can be seen.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace kilvo::lab {

/// Indices, in order, of rows such that a line drawn through them looks like the line through all: of each of `buckets` equal parts of the
/// rows the first row, and for each column those of its least and greatest value and of its first NaN, so that a hole stays a hole; and the
/// last row. Columns are equally long.
std::vector<std::size_t> thin(std::span<const std::vector<double>> columns, std::size_t buckets);

/// Indices of at most `limit` points, one for each voxel of a size that makes that so; all points when there are no more. Points with a
/// coordinate that is not finite are left out.
std::vector<std::size_t> thin_points(std::span<const Eigen::Vector3f> points, std::size_t limit);

}  // namespace kilvo::lab
