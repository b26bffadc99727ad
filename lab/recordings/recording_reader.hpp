// What every recording is, whatever its format: messages of topics, delivered by the time of their recording.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/sensors/time.hpp"
#include "lab/messages/encoding.hpp"

namespace kilvo::lab {

/// One topic as one publisher wrote it.
struct Channel {
  std::uint32_t id = 0;
  std::string topic;
  std::string type;             // plain_type_name()
  std::string md5sum = {};      // ROS 1 only
  std::string definition = {};  // of the type and those within, as ROS 1 or ROS 2 write it; empty where the recording has none
  Encoding encoding = Encoding::ros1;
};

/// The times at which messages of one channel were recorded.
struct TimesSummary {
  std::uint64_t count = 0;
  Time first{}, last{};
  Duration largest_gap{};

  void add(Time t);
  void append(const TimesSummary& later);
};

/// Nanoseconds as a file has them; what no clock shows (before 1970, or after the year 2223) becomes the nearest that one may, so that
/// times can be subtracted and added without care.
Time recorded_time(std::uint64_t ns);
Time recorded_time(std::int64_t ns);

struct Damage {
  std::uint64_t offset = 0;  // bytes from the beginning of the file
  std::string reason;
  std::string file = {};  // which, where a recording has several
};

struct RawMessage {
  const Channel* connection = nullptr;
  Time time{};           // when it was recorded
  Bytes bytes;           // valid until the next call of next()
  std::size_t size = 0;  // larger than `bytes` when the message is too large to be read (most_message_bytes)

  WireMessage wire() const { return {bytes, connection->encoding}; }
};

inline constexpr std::size_t most_message_bytes = std::size_t{64} << 20;
inline constexpr std::size_t most_damages = 100;
inline constexpr std::size_t most_definition_bytes = 256 << 10;  // longer definitions of types are not kept
inline constexpr std::size_t most_connections = 10'000;

/// For people.
struct StorageSummary {
  std::string format;       // "ROS 1 bag"
  std::string compression;  // "none", "lz4" or several, "none lz4"
  std::size_t chunks = 0;   // as the format has them; 0 where it has none
};

/// Never throws after construction; damage is noted and skipped. Memory is bounded, whatever the recording holds.
class RecordingReader {
 public:
  virtual ~RecordingReader() = default;

  virtual const std::string& name() const = 0;
  virtual std::uint64_t file_size() const = 0;
  virtual StorageSummary storage() const = 0;

  /// By channel id. A topic may have several.
  virtual const std::map<std::uint32_t, Channel>& connections() const = 0;
  /// Of all messages, by channel id.
  virtual const std::map<std::uint32_t, TimesSummary>& times() const = 0;
  /// Times of the first and the last message; both 0 when there is none.
  virtual Time begin() const = 0;
  virtual Time end() const = 0;

  /// Starts again at the beginning: messages of the channels that `wanted` approves, recorded in [from, until).
  virtual void select(const std::function<bool(const Channel&)>& wanted, Time from = Time::min(), Time until = Time::max()) = 0;
  /// Nothing at the end. Without select(): every message.
  virtual std::optional<RawMessage> next() = 0;

  /// What was found damaged so far, in the order of the file.
  virtual const std::vector<Damage>& damages() const = 0;
  std::optional<Damage> damage() const { return damages().empty() ? std::nullopt : std::optional(damages().front()); }
  /// Messages that came out later than a message recorded after them: 0 unless chunks overlap too deeply.
  virtual std::uint64_t late_messages() const = 0;
  /// Fraction of what was selected, 0 to 1.
  virtual double progress() const = 0;
};

}  // namespace kilvo::lab
