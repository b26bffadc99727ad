#include "kilvo/estimator/starter.hpp"

#include <algorithm>

#include "kilvo/input/timeline.hpp"

namespace kilvo {

std::optional<Start> Starter::add(Measurement m) {
  std::optional<Start> start;
  if (const auto* imu = std::get_if<ImuSample>(&m)) start = initialiser_.add(*imu);
  kept_.push_back(std::move(m));
  bound_images();
  // A moving start looks this far back and no farther.
  const Time oldest = completion_of(kept_.back()) - from_seconds(moving_start_ + 1.0);
  while (completion_of(kept_.front()) < oldest) {
    dropped_.push_back(sensor_of(kept_.front()));
    kept_.pop_front();
  }
  return start;
}

// Images are large, and only those of the still window will be of use.
void Starter::bound_images() {
  const auto* image = std::get_if<CameraImage>(&kept_.back());
  if (image == nullptr) return;
  const auto is_old = [oldest = image->t - 2 * still_time_](const Measurement& m) {
    return std::holds_alternative<CameraImage>(m) && stamp_of(m) < oldest;
  };
  dropped_.insert(dropped_.end(), std::erase_if(kept_, is_old), Sensor::camera);
}

}  // namespace kilvo
