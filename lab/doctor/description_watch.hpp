// The first seconds of a run, or of a life on the robot, held against the description, as kilvo doctor does it, while the run goes on.
#pragma once

#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/sensors/robot.hpp"
#include "lab/doctor/examination.hpp"
#include "lab/doctor/finding.hpp"
#include "lab/doctor/recorded.hpp"

namespace kilvo::lab {

struct WrongDescription {
  Finding finding;
  Time t{};                  // what came until then shows it
  double after = 0;          // s of data
  bool spoils = false;       // results with such a description are worthless, and not only worse
  bool is_mendable = false;  // by settings, and the estimator does not cope with it without them
  bool has_changed = false;  // the data before did not show it, and all that they could show was known
};

/// What the finding means for a run.
WrongDescription as_wrong(const Finding& finding, Time t, double after);
/// Whether more data show the description to be right: they do not find it again, and leave nothing open.
bool is_refuted(const Finding& finding, const Diagnosis& longer);
/// What is left of it then is a warning, and nothing is to be changed.
void refute(WrongDescription& wrong);

class DescriptionWatch {
 public:
  /// here: in take(); beside: in a thread of its own, the same findings; live: likewise, and take() never waits for it.
  enum class Judging : std::uint8_t { here, beside, live };

  DescriptionWatch(const Robot& robot, const Reading& reading, Judging judging)
      : robot_(robot), judging_(judging), reading_(reading), now_(empty()), whole_(empty()) {}
  /// Each measurement, in the order of arrival; from any thread. Images are not looked at. What the first windows show is judged once; legs
  /// and IMU alone, which nothing else contradicts, to the end: what two windows show that did not show before has changed.
  void take(const Measurement& measurement);
  /// What has been found since the last call. Does not wait.
  std::vector<WrongDescription> news();
  /// Judges what has come, and waits for it: all that was found.
  std::vector<WrongDescription> finish();

 private:
  struct Verdict {
    std::vector<Finding> findings;
    bool known = false;  // nothing that more data could show was left open
    Earlier earlier;
    Time begin{}, t{};
    std::optional<std::pair<double, double>> gyro_bias;  // see Diagnosis
  };
  void compare_gyro_bias(Verdict& verdict);
  void begin(Time t);
  void begin_anew();
  bool needs_whole() const;
  void judge(Time t);
  void collect();
  WrongDescription as_changed(WrongDescription wrong, Time begin) const;
  bool moved() const;
  double due() const;

  struct Window {
    Recorder recorder;
    std::optional<Time> begin;
  };
  Window empty() const { return {Recorder(reading_), {}}; }

  Robot robot_;
  Judging judging_;
  Reading reading_;
  std::mutex mutex_;
  Window now_;
  Window whole_;  // all since the first window in which the robot moved began, while no LiDAR has come
  std::optional<Time> origin_, last_, last_lidar_;
  std::size_t due_ = 0;                                                          // index of the next judgement of this window
  enum class Phase : std::uint8_t { first, open, later } phase_ = Phase::first;  // of windows
  std::optional<Time> known_;                                                    // since then: all that data of this kind can show
  bool window_has_lidar_ = false;                                                // clouds came in this window
  bool lidar_is_new_ = true;                                                     // no judgement has had clouds
  struct Doubt {
    std::string cause;
    Time begin{};  // of the first of the windows that show it
  };
  std::optional<std::pair<double, double>> gyro_bias_;  // of the first window that showed it
  std::vector<Doubt> doubts_;                           // of the last window, when all was known before
  bool over_ = false;                                   // no more is judged
  bool first_ = true;                                   // window: judged even when the robot stands, for units and rates
  int windows_ = 0;                                     // in which the robot moved
  Earlier earlier_;                                     // what the judgement before has shown
  double turned_ = 0;                                   // rad, by the gyro in this window
  std::optional<Time> last_imu_;
  std::future<Verdict> future_;
  std::vector<WrongDescription> found_;
  std::size_t told_ = 0;  // of them
};

}  // namespace kilvo::lab
