// Finds out from the first clouds of a topic how the times of their points are written, one cloud at a time.
#pragma once

#include <string>
#include <vector>

#include "lab/messages/encoding.hpp"
#include "lab/messages/point_time.hpp"

namespace kilvo::lab {

class PointTimeSearch {
 public:
  /// `type`: one of those of the LiDAR. `nominal_rate`: Hz, 0 when unknown.
  PointTimeSearch(std::string type, double nominal_rate) : type_(std::move(type)), nominal_rate_(nominal_rate) {}

  /// A message that cannot be decoded is passed over.
  void look_at(const WireMessage& message);

  /// Enough full clouds have been seen.
  bool has_enough() const { return full_.size() >= clouds_to_look_at; }
  /// Small clouds only, but so many that no full ones can be expected.
  bool has_only_small() const { return full_.empty() && small_.size() >= clouds_to_look_at; }
  bool has_any() const { return !full_.empty() || !small_.empty(); }

  /// By what has been seen, full clouds if there are any. Only when has_any(). The error names the fields.
  Decoded<PointTimeFormat> decide() const;

 private:
  std::string type_;
  double nominal_rate_;
  std::vector<CloudTimes> full_, small_;
};

}  // namespace kilvo::lab
