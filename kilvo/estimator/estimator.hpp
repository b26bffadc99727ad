// The estimator: measurements in, states out. Values only: it never throws after construction, never prints, never asks the time.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/estimator/clipping.hpp"
#include "kilvo/estimator/clock_steps.hpp"
#include "kilvo/estimator/config.hpp"
#include "kilvo/estimator/initialise.hpp"
#include "kilvo/estimator/map_error.hpp"
#include "kilvo/estimator/output.hpp"
#include "kilvo/estimator/recovery.hpp"
#include "kilvo/estimator/relocate.hpp"
#include "kilvo/estimator/replay.hpp"
#include "kilvo/estimator/time_offset.hpp"
#include "kilvo/estimator/timeline.hpp"
#include "kilvo/filter/trajectory.hpp"
#include "kilvo/legs/contact_detector.hpp"
#include "kilvo/lidar/undistort.hpp"
#include "kilvo/map/visual_map.hpp"
#include "kilvo/map/voxel_map.hpp"
#include "kilvo/sensors/robot.hpp"
#include "kilvo/vision/camera.hpp"
#include "kilvo/vision/mount_check.hpp"
#include "kilvo/vision/photometric.hpp"

namespace kilvo {

class LivePropagator;

class Estimator {
 public:
  /// `used`: which sensors will be pushed, by Sensor; others are ignored and counted. Throws std::invalid_argument when a setting makes
  /// no sense (its name is in the text).
  Estimator(const Robot& robot, const EstimatorConfig& config, std::array<bool, sensor_count> used);

  /// The surroundings are known: sweeps are registered to this map, in the estimator's world, and leave it as it is. Before the first
  /// push.
  void give_map(VoxelMap map);

  /// Takes a measurement in the order of its arrival; returns what became known, in time order.
  std::vector<Output> push(Measurement m);
  /// The same, appended to `out`: a caller that uses one vector again and again spares the leg path its only allocation.
  void push(Measurement m, std::vector<Output>& out);

  /// For who cannot wait for sweeps and images: sets a live propagator to the present state, from which it goes on by itself. False, and
  /// nothing is changed, before the start.
  bool fork(LivePropagator& into) const;

  /// No more measurements will come: what still waits is processed.
  std::vector<Output> finish();

  /// Why leg messages like this one cannot be used with this robot, if so: the first of them decides whether a run makes sense.
  std::optional<std::string> mismatch(const JointSample& s) const { return kinematics_ ? kinematics_->mismatch(s) : std::nullopt; }

  const Statistics& statistics() const { return statistics_; }
  /// Events that no output has carried: after finish(), or before the first output.
  std::vector<Event> take_events() { return events_.take(); }
  /// Of the messages as they have arrived until now.
  const Health& health() const { return health_; }
  const VoxelMap& map() const { return map_; }
  bool initialised() const { return estimate_.has_value(); }
  /// Of the outputs to come (Output::epoch).
  std::uint32_t epoch() const { return epoch_; }
  /// What it waits for before the first output; empty afterwards.
  std::string waiting_for() const { return initialised() ? std::string() : initialiser_.waiting_for(); }

 private:
  struct Pending {
    std::variant<LidarScan, CameraImage> what;
    Time begin, end;  // of the scan; the image's stamp
    Sensor sensor() const { return std::holds_alternative<LidarScan>(what) ? Sensor::lidar : Sensor::camera; }
    Time middle() const { return begin + (end - begin) / 2; }
  };

  // estimator.cpp: the order of things
  void handle(Measurement& m, std::vector<Output>& out);
  void handle_before_start(Measurement& m, std::vector<Output>& out);
  void begin(const Start& start, std::vector<Output>& out);
  void wait_for_imu(Pending what);
  void bound_images_before_start();
  bool uses(Sensor s) const { return used_[static_cast<std::size_t>(s)]; }
  bool keep_finite(bool definite = false);  // `definite`: looks at the whole covariance
  Output output_now();                      // with what a sweep and an image left to go out
  void emit(std::vector<Output>& out, std::optional<Contacts> contacts = {}, double kinematic_us = 0, double contact_us = 0);

  void note_clock_step();
  void begin_new_epoch(std::vector<Output>& out);
  void finish(std::vector<Output>& out);

  // findings.cpp: what is reported beside the states
  struct Use {
    std::array<std::uint64_t, sensor_count> used{};
    std::array<std::array<std::uint64_t, reason_count>, sensor_count> dropped{};
    std::uint64_t unsupported = 0;
  };
  Time now() const;
  void report(std::optional<Sensor> sensor, Reason reason, double value = 0, std::string detail = {});
  void drop(Sensor sensor, Reason reason, const std::string& text = {});  // `text`: more exact than the reason's
  void change_modality(Modality modality, Reason cause);
  void look_at_streams(Time t);
  void note_clipping(ImuSample& s);
  void report_streams();
  void report_use(const Use& before);

  // agreement.cpp: whether what the senses say can be true together
  void look_at_agreement(Time t);
  void judge_speed();
  void judge_biases();
  Sensor witness_against(Sensor s) const;
  void contradict(Reason reason, Sensor a, Sensor b, double value, const std::string& why);

  // asynchronous.cpp: IMU and legs
  void handle_imu(ImuSample s, std::vector<Output>& out);
  void handle_legs(const JointSample& s, std::vector<Output>& out);
  void keep_a_stance(const LegStep& step);

  // switching.cpp: which sensors are used, and how they come back
  void inflate_velocity_covariance();
  void choose_modality(Time t);
  Reason cause_of_change(Time t, Modality now) const;
  void lose_imu(std::vector<Output>& out);
  void bridge(Time silent_since, std::vector<Output>& out);
  void lose_legs(Time t);
  bool legs_may_return(Time t);
  void zero_velocity_update(const ImuSample& s);  // without any other sensor, a robot that stands has no velocity
  bool register_sweep(const Estimate& prior, LidarModel& model, const std::vector<PointCluster>& clusters,
                      const UndistortionNoise& within_scan);
  bool may_learn(const Estimate& prior, const RegistrationReport& report);
  void refuse_sweep(Time t);
  void note_outage(Time sweep_begin);

  // sequential.cpp: sweeps
  void process_pending(Time until, std::vector<Output>& out);
  bool waits_for_scan(Time image, Time until) const;
  void process(const LidarScan& scan, Time end, std::vector<Output>& out);
  bool has_no_shape(const Estimate& prior) const;
  void learn(const LidarModel& model, const std::vector<PointCluster>& clusters, bool registered);  // the map grows
  void rebase(const Estimate& e);                                                                   // nothing before it will be replayed

  // clocks.cpp: sensors whose stamps are off the IMU's
  void shift(Measurement& m) const;
  double least_offset(Sensor s) const;
  void check_lidar_clock(const Estimate& prior, Time begin, Time end);
  void check_camera_clock();
  void move_clock(Sensor s, double by);

  // images.cpp
  std::optional<Reason> image_fault(const CameraImage& image);
  std::optional<SE3> camera_from_state(Time image) const;
  void process(const CameraImage& image);
  void note_drift(std::span<const PhotometricModel::FrameShare> shares, const SE3& T_WI);
  PoseCovariance doubt_of_way(std::span<const PhotometricModel::FrameShare> shares, const SE3& T_WI) const;
  Eigen::Vector3d position_of(const VisualFrame& frame) const;
  bool is_lost_among_patches(const Estimate& prior) const;
  bool says_nothing(const PhotometricModel::Report& report);
  void check_mount(const PhotometricModel& model, const SO3& R_WI, const Eigen::Vector3d& omega);
  void learn_from(const SE3& T_CI, const PhotometricModel& model, std::span<const PatchCandidate> tracks,
                  std::span<const GreyImage> pyramid, const DepthView& depth, const Estimate& prior, const Eigen::Vector3d& omega);

  Robot robot_;
  EstimatorConfig config_;
  std::array<bool, sensor_count> used_;
  Timeline timeline_;
  Initialiser initialiser_;
  std::deque<Measurement> before_start_;
  double accel_scale_ = 1;

  std::optional<Estimate> estimate_;  // now: at the newest IMU or leg sample
  Estimate closed_;                   // at the newest IMU sample, all intervals before it with both their ends
  Estimate good_;                     // the last closed_ that made sense
  Estimate anchor_;                   // after the last sweep, at the sweep's own time; what came since is replayed on it
  Replay replay_;                     // from the anchor on
  std::deque<Pending> pending_;       // by end
  bool ended_ = false;
  std::uint32_t epoch_ = 0;
  std::deque<Output> sweeps_;  // results of sweeps, each to go out with one of the next leg samples
  std::deque<Output> images_;  // the same of images
  std::optional<Time> last_output_;
  Trajectory trajectory_;
  VoxelMap map_;
  bool map_is_given_ = false;
  Workers workers_;
  MapError map_error_;
  PoseCovariance unobservable_ = PoseCovariance::Zero();  // takes a pose error to its part along what the last sweep did not know

  std::optional<Camera> camera_;
  SE3 T_CI_;
  VisualMap visual_map_;
  MountCheck mount_check_;
  bool size_is_doubted_ = false;
  Time mount_doubted_until_{};
  Duration mount_pause_{};
  int images_in_vain_ = 0;
  Time images_from_{};             // earlier ones are not used
  Time sweeps_from_{};             // earlier ones are used when the velocity is known
  std::vector<PointXYZI> seen_W_;  // points of the last sweep

  std::unique_ptr<LegKinematics> kinematics_;
  ContactDetector contacts_;
  StanceTracker stances_;
  std::optional<Time> last_legs_;  // while the legs are used
  double leg_period_ = 0;          // between the last two leg samples, s
  double closing_us_ = 0;          // what it took to close the IMU's intervals since the last leg sample
  ClippingDetector clipping_;
  TimeOffset lidar_clock_;
  std::array<Duration, sensor_count> shift_{};              // found, and added to the stamps, by Sensor
  Time last_used_stance_{};                                 // when a foot was used last
  Time last_stance_{};                                      // the same, or since when that is waited for
  Time last_sweep_{};                                       // end of the last sweep, or the start
  Time last_middle_{};                                      // of the last sweep
  std::optional<Time> last_image_;                          // that was used
  Eigen::Vector3d last_image_p_ = Eigen::Vector3d::Zero();  // m
  Modality modality_ = Modality::coast;
  Reason cause_ = Reason::start;
  ClockSteps clock_steps_;
  Health health_;
  StationarityDetector stationarity_;
  Recovery recovery_;
  Statistics statistics_;
  EventLog events_;
  std::array<std::array<std::uint64_t, reason_count>, sensor_count> drops_{};  // by Sensor and Reason
  Use used_before_;
  Time streams_looked_at_{}, use_looked_at_{}, agreement_looked_at_{};
  Eigen::Vector3d first_ba_ = Eigen::Vector3d::Zero(), first_bg_ = Eigen::Vector3d::Zero();
  bool strange_biases_ = false;
  std::uint64_t lost_stances_before_ = 0;
  double leg_length_ = 1;  // m
};

}  // namespace kilvo
