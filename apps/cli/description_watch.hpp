// The first seconds of a run held against the description, as kilvo doctor does it, while the run goes on.
#pragma once

#include <future>
#include <string>
#include <vector>

#include "kilvo/sensors/robot.hpp"
#include "lab/doctor/finding.hpp"
#include "lab/doctor/recorded.hpp"

namespace kilvo::cli {

class DescriptionWatch {
 public:
  /// `beside`: judge in a thread of its own. What is found does not depend on it.
  DescriptionWatch(const Robot& robot, bool beside) : robot_(robot), beside_(beside) {}
  /// Each measurement, in the order of arrival. Images are not looked at.
  void take(const Measurement& measurement);
  /// Waits until all is judged.
  const std::vector<lab::Finding>& findings();

  /// Whether results with such a description are worthless, and not only worse.
  static bool spoils(const lab::Finding& finding);

 private:
  void judge();

  Robot robot_;
  bool beside_;
  lab::Recorder recorder_;
  std::optional<Time> begin_;
  bool judged_ = false;
  std::future<std::vector<lab::Finding>> future_;
  std::vector<lab::Finding> findings_;
};

}  // namespace kilvo::cli
