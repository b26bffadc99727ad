// Leg samples from messages that hold the joints in parts: robots whose legs, arms and waist have a controller each publish them so, on
// one topic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "kilvo/sensors/measurement.hpp"

namespace kilvo::lab {

class JointAssembly {
 public:
  /// `needed`: the joints between the IMU and the feet, as the messages name them. None: every message is a sample by itself.
  /// `with_velocities`: those in the messages are used.
  explicit JointAssembly(JointNames needed = {}, bool with_velocities = true)
      : needed_(std::move(needed)), with_velocities_(with_velocities), joints_(needed_.size()) {}

  /// Messages in the order of their arrival. A message that holds all joints is given back as it is; a part gives the sample that it
  /// completes, or nothing; one without any of them (arms) nothing. After one second without a whole sample parts are given back as they
  /// are, and after one without any joint of the legs all others: what is missing is for the estimator to say.
  /// Velocities of the legs that are NaN from the first message on, or zero while the positions change, are left out until some are known:
  /// their driver may not know them.
  std::optional<JointSample> join(JointSample message, Time arrived);

  /// Whether the last message held joints of the legs.
  bool is_of_legs() const { return needed_.empty() || found_ > 0; }

  /// Parts whose values were never used: newer ones came before all others did.
  std::uint64_t unused() const { return unused_; }

 private:
  struct Joint {
    std::optional<Time> t;  // of the newest value
    Duration interval{};    // between values, the mean of lately; 0: not known
    double position = 0, velocity = 0, effort = 0;
    double rate = 0;  // rad/s: the velocity, or the difference to the value before
    bool has_velocity = false, has_effort = false, is_used = false;
  };
  void look_up(const JointNames& names);
  void clear_unknown_velocities(JointSample& message);
  void note(const JointSample& part);
  bool is_whole(Time newest, Duration interval) const;
  JointSample sample(Time newest);

  JointNames needed_;
  bool with_velocities_;
  std::vector<Joint> joints_;                       // as needed_
  JointNames names_;                                // of the newest message
  std::vector<std::optional<std::size_t>> places_;  // in it, by joint
  std::size_t found_ = 0;                           // joints in it
  bool comes_whole_ = false;                        // a message held all joints
  bool knows_velocities_ = false;                   // a message had some of the legs
  std::vector<double> last_positions_;              // until then: of the message before
  std::optional<Time> legs_;                        // arrival of the last message that held joints of the legs, or of the first of all
  std::optional<Time> whole_;                       // arrival of what made the last sample, or of the first part
  std::optional<Time> given_;                       // stamp of the last sample
  std::uint64_t unused_ = 0;
};

}  // namespace kilvo::lab
