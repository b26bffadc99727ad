// A place in a DDS domain: which network interface, which peers; and what is made in it.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "apps/dds/types.hpp"

struct dds_qos;

namespace kilvo::dds {

struct DomainOptions {
  int domain = 0;
  std::string interface;           // name or address of the network interface; empty: the one that Cyclone DDS finds
  std::vector<std::string> peers;  // addresses to look for others at; without any, others are found by multicast
};

/// DDS could not do what it was asked; the text says what that was, and why.
struct DdsError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What Cyclone DDS is told: its own configuration in XML, after that of the environment (CYCLONEDDS_URI). Throws DdsError when a name or
/// an address has characters that none has.
std::string domain_xml(const DomainOptions& options);

/// Anything that DDS calls an entity; deleted with all that was made from it.
class Entity {
 public:
  using Handle = std::int32_t;
  Entity() = default;
  /// Throws DdsError when `handle` is an error; `what` was to be made.
  Entity(Handle handle, const std::string& what);
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Entity();

  Handle get() const { return handle_; }

 private:
  Handle handle_ = 0;
};

using Qos = std::unique_ptr<dds_qos, void (*)(dds_qos*)>;

/// Quality of service as ROS 2 has it. Depth: how many messages are kept.
struct QosChoice {
  bool is_reliable = false;
  bool is_kept_for_latecomers = false;  // transient local
  std::int32_t depth = 10;
  std::string user_data = {};
};
Qos make_qos(const QosChoice& choice);

class Domain {
 public:
  explicit Domain(const DomainOptions& options);

  Entity::Handle participant() const { return participant_.get(); }
  Entity make_reader(const std::string& topic, const DdsType& type, const QosChoice& choice) const;
  Entity make_writer(const std::string& topic, const DdsType& type, const QosChoice& choice) const;

 private:
  Entity domain_, participant_;
};

}  // namespace kilvo::dds
