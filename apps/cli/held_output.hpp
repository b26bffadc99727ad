// What the files of a run need of an output, in a fifth of its size: outputs wait until the world is level.
// Of a live runner states and sweeps come apart.
#pragma once

#include "kilvo/estimator/output.hpp"

namespace kilvo::cli {

class HeldOutput {
 public:
  enum class Part : std::uint8_t { whole, state, sweep };

  HeldOutput(const Output& o, Part part)
      : part_(part),
        t_(o.t),
        x_(o.x),
        R_LW_(o.R_LW),
        omega_(o.omega),
        pose_P_(o.P.topLeftCorner<6, 6>()),
        modality_(o.modality),
        cause_(o.cause),
        is_sweep_(o.is_sweep),
        is_image_(o.is_image),
        contacts_(o.contacts),
        kinematic_us_(o.kinematic_us),
        contact_us_(o.contact_us),
        stages_(o.stages),
        indicators_(o.indicators),
        events_(o.events) {}

  Part part() const { return part_; }
  /// The output again, without clouds, report and what its covariance said beyond the pose.
  Output output() const {
    Output o;
    o.t = t_;
    o.x = x_;
    o.R_LW = R_LW_;
    o.omega = omega_;
    o.P.topLeftCorner<6, 6>() = pose_P_;
    o.modality = modality_;
    o.cause = cause_;
    o.is_sweep = is_sweep_;
    o.is_image = is_image_;
    o.contacts = contacts_;
    o.kinematic_us = kinematic_us_;
    o.contact_us = contact_us_;
    o.stages = stages_;
    o.indicators = indicators_;
    o.events = events_;
    return o;
  }

 private:
  Part part_;
  Time t_;
  State x_;
  std::optional<SO3> R_LW_;
  Eigen::Vector3d omega_;
  Eigen::Matrix<double, 6, 6> pose_P_;
  Modality modality_;
  Reason cause_;
  bool is_sweep_, is_image_;
  std::optional<Contacts> contacts_;
  double kinematic_us_, contact_us_;
  StageTimes stages_;
  std::vector<Indicator> indicators_;
  std::vector<Event> events_;
};

}  // namespace kilvo::cli
