#include "apps/dds/dds_inputs.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <fmt/core.h>

#include "apps/dds/dds_outlet.hpp"
#include "apps/live/thread_settings.hpp"
#include "lab/messages/message_decoder.hpp"

namespace kilvo::dds {

struct DdsInputs::Publisher {
  std::string key;          // the bytes of its identifier
  std::string topic, type;  // type: plain
  std::string partition;    // the first; empty: none
  bool is_exclusive = false;
};

namespace {

constexpr std::int32_t most_samples = 500, most_pictures = 4;  // that wait for their thread
constexpr dds_duration_t soon = DDS_MSECS(200);

std::string accepted_text(Sensor sensor) {
  std::string text;
  for (const auto type : lab::accepted_types(sensor)) {
    if (find_type(type) != nullptr) text += fmt::format("{}{}", text.empty() ? "" : " or ", type);
  }
  return text;
}

/// The bytes of a message, with its encapsulation header, for as long as it lives.
class SerializedBytes {
 public:
  explicit SerializedBytes(ddsi_serdata* data) : data_(data) { held_ = ddsi_serdata_to_ser_ref(data, 0, ddsi_serdata_size(data), &all_); }
  ~SerializedBytes() {
    ddsi_serdata_to_ser_unref(held_, &all_);
    ddsi_serdata_unref(data_);
  }
  SerializedBytes(const SerializedBytes&) = delete;
  SerializedBytes& operator=(const SerializedBytes&) = delete;
  lab::Bytes bytes() const { return {static_cast<const std::uint8_t*>(all_.iov_base), all_.iov_len}; }

 private:
  ddsi_serdata* data_;
  ddsi_serdata* held_;
  ddsrt_iovec_t all_{};
};

std::string first_partition(const dds_qos_t* qos) {
  std::uint32_t count = 0;
  char** names = nullptr;
  if (qos == nullptr || !dds_qget_partition(qos, &count, &names)) return "";
  std::string out;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i == 0) out = names[i];
    dds_free(names[i]);
  }
  dds_free(names);
  return out;
}

bool wants_exclusive(const dds_qos_t* qos) {
  dds_ownership_kind_t kind = DDS_OWNERSHIP_SHARED;
  return qos != nullptr && dds_qget_ownership(qos, &kind) && kind == DDS_OWNERSHIP_EXCLUSIVE;
}

}  // namespace

DdsInputs::DdsInputs(const Domain& domain, const lab::Settings& settings, node::SensorInputs& inputs) : domain_(domain), inputs_(inputs) {
  for (const Sensor sensor : all_sensors) {
    if (!settings.has(sensor)) continue;
    const std::string topic = dds_topic(settings.topic(sensor));
    subscribe(sensor, topic, false);
    if (sensor == Sensor::camera && !topic.ends_with("/compressed")) subscribe(sensor, topic + "/compressed", true);
  }
  const Entity::Handle all = domain.participant();
  publications_ = Entity(dds_create_reader(all, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr), "a reader of who publishes");
  stop_ = Entity(dds_create_guardcondition(all), "a condition");
  for (Entity* waitset : {&discovery_, &quick_, &slow_}) {
    *waitset = Entity(dds_create_waitset(all), "a waitset");
    dds_waitset_attach(waitset->get(), stop_.get(), 0);
  }
  dds_set_status_mask(publications_.get(), DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(discovery_.get(), publications_.get(), 0);
  threads_.emplace_back([this] { run_readers(quick_); });
  threads_.emplace_back([this] { run_readers(slow_); });
  threads_.emplace_back([this] { run_discovery(); });
}

void DdsInputs::stop() {
  stopping_ = true;
  dds_set_guardcondition(stop_.get(), true);
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void DdsInputs::subscribe(Sensor sensor, const std::string& topic, bool is_compressed) {
  const auto same = std::ranges::find(subscriptions_, topic, &Subscription::topic);
  if (same != subscriptions_.end()) {
    same->sensors.push_back(sensor);
    return;
  }
  Subscription& own = subscriptions_.emplace_back();
  own.topic = topic;
  own.sensors = {sensor};
  own.is_compressed = is_compressed;
  own.is_quick = node::is_quick(sensor);
}

// ---- who publishes

void DdsInputs::run_discovery() {
  live::settle_thread({"kilvo-discover", 0, -1});
  while (!stopping_) {
    dds_waitset_wait(discovery_.get(), nullptr, 0, DDS_INFINITY);
    if (!stopping_) discover();
  }
}

void DdsInputs::discover() {
  constexpr std::uint32_t most = 32;
  while (true) {
    std::array<void*, most> samples{};
    std::array<dds_sample_info_t, most> infos{};
    const dds_return_t count = dds_take(publications_.get(), samples.data(), infos.data(), most, most);
    if (count <= 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto& endpoint = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      Publisher publisher;
      publisher.key.assign(std::begin(endpoint.key.v), std::end(endpoint.key.v));
      const bool is_alive = infos[i].valid_data && infos[i].instance_state == DDS_ALIVE_INSTANCE_STATE;
      if (infos[i].valid_data) {
        publisher.topic = endpoint.topic_name;
        publisher.type = lab::plain_type_name(endpoint.type_name);
        publisher.partition = first_partition(endpoint.qos);
        publisher.is_exclusive = wants_exclusive(endpoint.qos);
      }
      note(publisher, is_alive);
    }
    dds_return_loan(publications_.get(), samples.data(), count);
  }
}

void DdsInputs::note(const Publisher& publisher, bool is_alive) {
  for (Subscription& subscription : subscriptions_) {
    if (!is_alive) {
      subscription.misfits.erase(publisher.key);
    } else if (subscription.topic == publisher.topic) {
      std::string why;
      try {
        why = misfit_of(subscription, publisher);
      } catch (const DdsError& error) {
        why = error.what();
      }
      subscription.misfits.erase(publisher.key);
      if (!why.empty()) subscription.misfits[publisher.key] = why;
    } else {
      continue;
    }
    for (const Sensor sensor : subscription.sensors)
      inputs_.note_connection(sensor, subscription.misfits.empty() ? "" : subscription.misfits.begin()->second);
  }
}

// Why a publisher cannot be read; empty: it can, and there is a reader for it.
std::string DdsInputs::misfit_of(Subscription& subscription, const Publisher& publisher) {
  const Sensor sensor = subscription.sensors.front();
  if (publisher.type == "unitree_go/LowState" && sensor == Sensor::legs)
    return "a publisher sends unitree_go/LowState (Go2, B2, H1): its legs are not read; what is read are those of a G1, or a JointState";
  const DdsType* type = find_type(publisher.type);
  const bool fits =
      type != nullptr && std::ranges::any_of(subscription.sensors, [&](Sensor s) { return lab::is_type_of(s, publisher.type); });
  if (!fits) return fmt::format("a publisher sends {}, but the sensor {} needs {}", publisher.type, name_of(sensor), accepted_text(sensor));
  if (!publisher.partition.empty())
    return fmt::format("a publisher is in the partition '{}': KILVO reads the default one", publisher.partition);
  if (publisher.is_exclusive) return "a publisher's quality of service does not fit: its ownership is exclusive";
  listen_to(subscription, *type);
  return "";
}

void DdsInputs::listen_to(Subscription& subscription, const DdsType& type) {
  if (std::ranges::find(subscription.readers, &type, &Reader::type) != subscription.readers.end()) return;
  Reader& reader = subscription.readers.emplace_back();
  reader.type = &type;
  reader.subscription = &subscription;
  reader.entity = domain_.make_reader(subscription.topic, type, {.depth = subscription.is_quick ? most_samples : most_pictures});
  dds_set_status_mask(reader.entity.get(), DDS_DATA_AVAILABLE_STATUS);
  const Entity& waitset = subscription.is_quick ? quick_ : slow_;
  dds_waitset_attach(waitset.get(), reader.entity.get(), static_cast<dds_attach_t>(reinterpret_cast<std::intptr_t>(&reader)));
}

// ---- their messages

void DdsInputs::run_readers(const Entity& waitset) {
  live::settle_thread({&waitset == &quick_ ? "kilvo-quick" : "kilvo-pictures", 0, -1});
  std::array<dds_attach_t, 16> ready{};
  while (!stopping_) {
    const dds_return_t count = dds_waitset_wait(waitset.get(), ready.data(), ready.size(), soon);
    for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(0, count)) && i < ready.size() && !stopping_; ++i) {
      if (ready[i] != 0) take(*reinterpret_cast<Reader*>(ready[i]));
    }
  }
}

void DdsInputs::take(Reader& reader) {
  constexpr std::uint32_t most = 64;
  std::array<ddsi_serdata*, most> messages{};
  std::array<dds_sample_info_t, most> infos{};
  const dds_return_t count = dds_takecdr(reader.entity.get(), messages.data(), most, infos.data(), DDS_ANY_STATE);
  const Time now = time_from_ns(dds_time());
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(0, count)); ++i) {
    const SerializedBytes message(messages[i]);
    if (!infos[i].valid_data) continue;
    const Time arrived = now + Duration(i);  // messages that are taken at once are not one message
    for (const Sensor sensor : reader.subscription->sensors) {
      if (lab::is_type_of(sensor, reader.type->name))
        inputs_.receive(sensor, {reader.type->name, {message.bytes(), lab::Encoding::cdr}, arrived}, reader.subscription->is_compressed);
    }
  }
}

}  // namespace kilvo::dds
