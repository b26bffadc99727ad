// The other side of `kilvo live` in tests: Fast DDS, which is another vendor's, plays a recording as a robot would, and listens.
//
// clang-format off
//   peer play BAG DOMAIN [--legs lowstate [--mode-pr N] [--mode-machine N] [--crc N]] [--stamps recorded] [--start S] [--seconds S]
//             [--only imu,legs,lidar,camera]   a line of JSON when it begins: ns of that, and by how much stamps are later than recorded
//   peer listen DOMAIN FILE.tum SECONDS       odometry into a file, the smooth one into FILE.tum.smooth, when each pose of the first
//                                             came into FILE.tum.times (ns: stamp, time); at the end a line of JSON: how many of what
//   peer call DOMAIN SERVICE [0|1]            asks a service as rmw_cyclonedds does (kilvo/save_map; kilvo/pause/lidar 1); its answer as JSON
//   peer garbage DOMAIN SECONDS               bytes that are no Imu, on the IMU's topic
//   peer wrong-type DOMAIN SECONDS            clouds of a type that the LiDAR's topic should not have
//   peer picky DOMAIN SECONDS                 a reader that asks for more durability than there is
// clang-format on
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fstream>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "lab/clocks/link_kinematics.hpp"
#include "lab/recordings/recording_source.hpp"
#include "tests/dds/cdr_messages.hpp"

namespace kilvo::test {
namespace {

using namespace eprosima::fastdds::dds;
using Wall = std::chrono::system_clock;

Time wall_now() { return time_from_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(Wall::now().time_since_epoch()).count()); }

/// A participant on the loopback interface alone.
class Peer {
 public:
  explicit Peer(int domain) {
    DomainParticipantQos qos = PARTICIPANT_QOS_DEFAULT;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    udp->receiveBufferSize = udp->sendBufferSize = 4 << 20;  // some clouds, for a machine that is busy elsewhere
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    participant_ = DomainParticipantFactory::get_instance()->create_participant(static_cast<std::uint32_t>(domain), qos);
    if (participant_ == nullptr) throw std::runtime_error("no participant");
    publisher_ = participant_->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }
  ~Peer() {
    participant_->delete_contained_entities();
    DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  DataWriter* writer(const std::string& topic, const std::string& type, bool reliable) {
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.history().depth = reliable ? 20 : 100;
    // Fast DDS asks every 3 s what has not arrived: one lost fragment would hold back 30 clouds.
    qos.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0.05);
    qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return publisher_->create_datawriter(topic_of(topic, type), qos);
  }
  DataReader* reader(const std::string& topic, const std::string& type, DataReaderListener* listener, bool durable = false) {
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = durable ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
    qos.history().depth = 2000;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return subscriber_->create_datareader(topic_of(topic, type), qos, listener);
  }

 private:
  Topic* topic_of(const std::string& topic, const std::string& type) {
    TypeSupport support(new RawType(type));
    support.register_type(participant_);
    return participant_->create_topic(topic, type, TOPIC_QOS_DEFAULT);
  }

  DomainParticipant* participant_ = nullptr;
  Publisher* publisher_ = nullptr;
  Subscriber* subscriber_ = nullptr;
};

struct Words {
  std::vector<std::string> plain;
  std::map<std::string, std::string> options;
  std::string option(const std::string& name, const std::string& otherwise) const {
    const auto found = options.find(name);
    return found == options.end() ? otherwise : found->second;
  }
};

Measurement moved(Measurement m, Duration by) {
  std::visit([by](auto& x) { x.t += by; }, m);
  return m;
}

/// The walk's messages in real time, stamped as if it were now unless they are to be as they were recorded.
class Player {
 public:
  explicit Player(const Words& words)
      : peer_(std::stoi(words.plain.at(2))),
        with_low_state_(words.option("--legs", "") == "lowstate"),
        as_recorded_(words.option("--stamps", "") == "recorded"),
        source_(words.plain.at(1), options_of(words)) {
    modes_.pr = static_cast<std::uint8_t>(std::stoi(words.option("--mode-pr", "0")));
    modes_.machine = static_cast<std::uint8_t>(std::stoi(words.option("--mode-machine", "5")));
    modes_.crc = static_cast<std::uint32_t>(std::stoul(words.option("--crc", "0")));
    const std::string only = words.option("--only", "imu,legs,lidar");
    if (only.find("imu") != std::string::npos) imu_ = peer_.writer("rt/imu", "sensor_msgs::msg::dds_::Imu_", false);
    if (only.find("legs") != std::string::npos)
      legs_ = with_low_state_ ? peer_.writer("rt/lowstate", "unitree_hg::msg::dds_::LowState_", false)
                              : peer_.writer("rt/joint_states", "sensor_msgs::msg::dds_::JointState_", false);
    if (only.find("lidar") != std::string::npos) lidar_ = peer_.writer("rt/points", "sensor_msgs::msg::dds_::PointCloud2_", true);
    if (only.find("camera") != std::string::npos) camera_ = peer_.writer("rt/camera/image_raw", "sensor_msgs::msg::dds_::Image_", true);
    wait_for_readers();
  }

  void play() {
    const Time began = wall_now();
    std::optional<Time> first;
    while (auto m = source_.next()) {
      if (!first) {
        first = source_.recorded();
        std::printf("{\"began\": %lld, \"later_by\": %lld}\n", static_cast<long long>(to_ns(began)),
                    static_cast<long long>((began - *first).count()));
        std::fflush(stdout);
      }
      const Time due = began + (source_.recorded() - *first);
      if (const auto wait = due - wall_now(); wait.count() > 0) std::this_thread::sleep_for(wait);
      send(moved(*std::move(m), as_recorded_ ? Duration(0) : began - *first));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }

 private:
  static lab::RecordingOptions options_of(const Words& words) {
    lab::RecordingOptions options;
    options[Sensor::imu] = {true, "/imu", 200, 0};
    options[Sensor::legs] = {true, "/joint_states", 1000, 0};
    options[Sensor::lidar] = {true, "/points", 10, 0};
    options[Sensor::camera] = {words.option("--only", "").find("camera") != std::string::npos, "/camera/image_raw", 10, 0};
    options.start = std::stod(words.option("--start", "0"));
    options.duration = std::stod(words.option("--seconds", "1e9"));
    return options;
  }

  /// What is sent before both sides have found each other is lost, and a busy machine may need seconds for that. A topic that nobody
  /// reads costs the whole wait.
  void wait_for_readers() {
    const auto end = Wall::now() + std::chrono::seconds(10);
    for (DataWriter* writer : {imu_, legs_, lidar_, camera_}) {
      PublicationMatchedStatus status;
      while (writer != nullptr && Wall::now() < end) {
        writer->get_publication_matched_status(status);
        if (status.current_count > 0) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // the reader's side
  }

  void send(const Measurement& m) {
    DataWriter* writer = nullptr;
    RawMessage message;
    if (const auto* imu = std::get_if<ImuSample>(&m)) {
      newest_ = *imu;
      writer = imu_;
      message = imu_message(*imu);
    } else if (const auto* joints = std::get_if<JointSample>(&m)) {
      writer = legs_;
      // Of a 500 Hz robot every second sample. Its clock is its own.
      if (with_low_state_ && ++count_ % 2 != 0) return;
      const auto tick = static_cast<std::uint32_t>(to_ns(joints->t) / 1'000'000 + 12'345'678);
      message = with_low_state_ ? low_state_message(*joints, pelvis_rate(*joints), tick, modes_) : joint_state_message(*joints);
    } else if (const auto* scan = std::get_if<LidarScan>(&m)) {
      writer = lidar_;
      message = cloud_message(*scan);
    } else if (const auto* image = std::get_if<CameraImage>(&m)) {
      writer = camera_;
      message = image_message(*image);
    }
    if (writer != nullptr) writer->write(&message);
  }

  // The torso's without the waist's: the simulated waist turns about z only, and the IMU hangs upside down (config/robots/sim.yaml).
  Eigen::Vector3d pelvis_rate(const JointSample& joints) const {
    Eigen::Matrix3d R;
    R << 0.9992001067, 0, -0.03998933419, 0, -1, 0, -0.03998933419, 0, -0.9992001067;
    const auto i = static_cast<std::size_t>(std::find(joints.names.begin(), joints.names.end(), "waist_yaw_joint") - joints.names.begin());
    const Eigen::Matrix3d waist = Eigen::AngleAxisd(joints.position.at(i), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return waist * (R * newest_.gyro) - Eigen::Vector3d(0, 0, joints.velocity.at(i));
  }

  Peer peer_;
  bool with_low_state_, as_recorded_;
  LowStateModes modes_;
  lab::RecordingSource source_;
  DataWriter *imu_ = nullptr, *legs_ = nullptr, *lidar_ = nullptr, *camera_ = nullptr;
  ImuSample newest_;
  std::uint64_t count_ = 0;
};

/// Keeps what comes on one topic.
class Ear final : public DataReaderListener {
 public:
  explicit Ear(std::function<void(std::vector<char>&)> take = {}) : take_(std::move(take)) {}
  void on_data_available(DataReader* reader) override {
    RawMessage message;
    SampleInfo info;
    while (reader->take_next_sample(&message, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      ++count;
      if (take_) take_(message.bytes);
    }
  }
  std::atomic<int> count{0};

 private:
  std::function<void(std::vector<char>&)> take_;
};

/// An odometry message as a line of the file; its stamp.
Time keep_pose(std::vector<char>& bytes, std::ofstream& file) {
  eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
  Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
  cdr.read_encapsulation();
  std::int32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
  std::string frame, child;
  std::array<double, 7> p{};
  cdr >> seconds >> nanoseconds >> frame >> child >> p;
  char line[256];
  std::snprintf(line, sizeof line, "%d.%09u %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", seconds, nanoseconds, p[0], p[1], p[2], p[3], p[4], p[5],
                p[6]);
  file << line;
  return time_from_ns(std::int64_t{seconds} * 1'000'000'000 + nanoseconds);
}

int listen(const Words& words) {
  std::ofstream file(words.plain.at(2)), smooth_file(words.plain.at(2) + ".smooth"), times(words.plain.at(2) + ".times");
  std::vector<double> late;
  Time first{}, last{};
  int poses = 0;
  double largest_gap = 0;
  Ear odometry([&](std::vector<char>& bytes) {
    const Time t = keep_pose(bytes, file);
    const Time now = wall_now();
    late.push_back(to_seconds(now - t));
    times << to_ns(t) << ' ' << to_ns(now) << '\n';
    if (poses++ == 0) first = t;
    if (poses > 1) largest_gap = std::max(largest_gap, to_seconds(t - last));
    last = t;
  });
  Ear smooth([&](std::vector<char>& bytes) { keep_pose(bytes, smooth_file); });
  Ear transforms, clouds, contacts, path, diagnostics;
  Peer peer(std::stoi(words.plain.at(1)));
  peer.reader("rt/kilvo/odometry", "nav_msgs::msg::dds_::Odometry_", &odometry);
  peer.reader("rt/kilvo/odometry_smooth", "nav_msgs::msg::dds_::Odometry_", &smooth);
  peer.reader("rt/tf", "tf2_msgs::msg::dds_::TFMessage_", &transforms);
  peer.reader("rt/kilvo/cloud", "sensor_msgs::msg::dds_::PointCloud2_", &clouds);
  peer.reader("rt/kilvo/contacts", "sensor_msgs::msg::dds_::JointState_", &contacts);
  peer.reader("rt/kilvo/path", "nav_msgs::msg::dds_::Path_", &path);
  peer.reader("rt/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_", &diagnostics);
  std::this_thread::sleep_for(std::chrono::duration<double>(std::stod(words.plain.at(3))));
  std::sort(late.begin(), late.end());
  const auto quantile = [&late](double q) {
    return late.empty() ? 0.0 : 1e3 * late[static_cast<std::size_t>(q * static_cast<double>(late.size() - 1))];
  };
  const double span = poses > 1 ? to_seconds(last - first) : 0;
  std::printf(
      "{\"odometry\": %d, \"rate\": %.1f, \"largest_gap\": %.4f, \"late_ms\": [%.3f, %.3f, %.3f], \"smooth\": %d, \"transforms\": %d, "
      "\"clouds\": %d, \"contacts\": %d, \"paths\": %d, \"diagnostics\": %d}\n",
      poses, span > 0 ? (poses - 1) / span : 0, largest_gap, quantile(0.5), quantile(0.99), quantile(0.999), smooth.count.load(),
      transforms.count.load(), clouds.count.load(), contacts.count.load(), path.count.load(), diagnostics.count.load());
  return 0;
}

int disturb(const Words& words) {
  Peer peer(std::stoi(words.plain.at(1)));
  const double seconds = std::stod(words.plain.at(2));
  Ear ear;
  DataWriter* writer = nullptr;
  if (words.plain.at(0) == "garbage") writer = peer.writer("rt/imu", "sensor_msgs::msg::dds_::Imu_", false);
  if (words.plain.at(0) == "wrong-type") {
    const bool named = words.plain.size() > 4;
    writer = peer.writer(named ? words.plain[3] : "rt/points", named ? words.plain[4] : "sensor_msgs::msg::dds_::LaserScan_", true);
  }
  if (words.plain.at(0) == "picky") peer.reader("rt/kilvo/odometry", "nav_msgs::msg::dds_::Odometry_", &ear, true);
  std::mt19937 random(1);
  const auto end = Wall::now() + std::chrono::duration_cast<Wall::duration>(std::chrono::duration<double>(seconds));
  while (Wall::now() < end) {
    RawMessage message{{0, 1, 0, 0}};
    const std::size_t size = random() % 700;
    for (std::size_t i = 0; i < size; ++i) message.bytes.push_back(static_cast<char>(random()));
    if (writer != nullptr) writer->write(&message);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return 0;
}

/// Asks until there is an answer, for a request that comes before both sides have found each other is lost.
int call(const Words& words) {
  const std::string path = words.plain.at(2), type = path.find("/pause/") != std::string::npos ? "SetBool" : "Trigger";
  constexpr std::uint64_t client = 4711;
  std::mutex mutex;
  std::string answer;
  Ear replies([&](std::vector<char>& bytes) {
    eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
    Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
    cdr.read_encapsulation();
    std::uint64_t to = 0;
    std::int64_t number = 0;
    bool success = false;
    std::string message;
    cdr >> to >> number >> success >> message;
    if (to != client) return;
    const std::lock_guard lock(mutex);
    if (answer.empty()) answer = std::string("{\"success\": ") + (success ? "true" : "false") + ", \"message\": \"" + message + "\"}";
  });
  Peer peer(std::stoi(words.plain.at(1)));
  peer.reader("rr/" + path + "Reply", "std_srvs::srv::dds_::" + type + "_Response_", &replies);
  DataWriter* writer = peer.writer("rq/" + path + "Request", "std_srvs::srv::dds_::" + type + "_Request_", true);
  for (std::int64_t attempt = 0; attempt < 40; ++attempt) {
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
    const std::lock_guard lock(mutex);
    if (!answer.empty()) {
      std::printf("%s\n", answer.c_str());
      return 0;
    }
    if (attempt % 8 != 1) continue;
    CdrBuffer out;
    out.cdr() << client << attempt << static_cast<std::uint8_t>(words.plain.size() > 3 && words.plain[3] == "1");
    RawMessage message = out.message();
    writer->write(&message);
  }
  std::printf("{}\n");
  return 1;
}

int run(int argc, char** argv) {
  Words words;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.rfind("--", 0) == 0 && i + 1 < argc) {
      words.options[word] = argv[++i];
    } else {
      words.plain.push_back(word);
    }
  }
  if (words.plain.size() < 3) return 2;
  if (words.plain[0] == "listen") return listen(words);
  if (words.plain[0] == "call") return call(words);
  if (words.plain[0] != "play") return disturb(words);
  Player(words).play();
  return 0;
}

}  // namespace
}  // namespace kilvo::test

int main(int argc, char** argv) { return kilvo::test::run(argc, argv); }
