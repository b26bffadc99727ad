// A type of Fast DDS that holds a message as it is on the wire.
#pragma once

#include <cstring>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <string>
#include <vector>

namespace kilvo::test {

struct RawMessage {
  std::vector<char> bytes;  // with the encapsulation header
};

class RawType final : public eprosima::fastdds::dds::TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 4'000'000;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }

  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    const auto& bytes = static_cast<RawMessage*>(data)->bytes;
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = 1;  // CDR, little-endian
    return true;
  }
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* payload, void* data) override {
    const char* first = reinterpret_cast<const char*>(payload->data);
    static_cast<RawMessage*>(data)->bytes.assign(first, first + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<RawMessage*>(data)->bytes.size()); };
  }
  void* createData() override { return new RawMessage; }
  void deleteData(void* data) override { delete static_cast<RawMessage*>(data); }
  bool getKey(void*, eprosima::fastrtps::rtps::InstanceHandle_t*, bool) override { return false; }
};

}  // namespace kilvo::test
