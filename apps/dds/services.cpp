#include "apps/dds/services.hpp"

#include <dds/dds.h>
#include <services.h>

namespace kilvo::dds {
namespace {

const DdsType trigger_request{"std_srvs/Trigger_Request", "", &std_srvs_srv_dds__Trigger_Request__desc};
const DdsType trigger_response{"std_srvs/Trigger_Response", "", &std_srvs_srv_dds__Trigger_Response__desc};
const DdsType set_bool_request{"std_srvs/SetBool_Request", "", &std_srvs_srv_dds__SetBool_Request__desc};
const DdsType set_bool_response{"std_srvs/SetBool_Response", "", &std_srvs_srv_dds__SetBool_Response__desc};

/// Takes one request and answers it; false when there is none.
template <class Request, class Response>
bool answer_one(Entity::Handle requests, Entity::Handle replies, const auto& call) {
  Request request{};
  void* sample = &request;
  dds_sample_info_t info{};
  if (dds_take(requests, &sample, &info, 1, 1) <= 0) return false;
  if (!info.valid_data) return true;
  node::Answer answer = call(request);
  Response response{};
  response.client = request.client;
  response.sequence_number = request.sequence_number;
  response.success = answer.success;
  response.message = answer.message.data();
  dds_write(replies, &response);
  return true;
}

}  // namespace

Services::Services(const Domain& domain, const std::string& name, node::Node& node) {
  offer(domain, name + "/save_map", false, [&node](bool) { return node.save_map(); });
  offer(domain, name + "/reset", false, [&node](bool) { return node.reset(); });
  for (const Sensor sensor : node.sensors_to_pause())
    offer(domain, name + "/pause/" + name_of(sensor), true, [&node, sensor](bool paused) { return node.pause(sensor, paused); });
}

void Services::offer(const Domain& domain, const std::string& path, bool is_set_bool, std::function<node::Answer(bool)> call) {
  const QosChoice choice{.is_reliable = true, .depth = 10};
  services_.push_back({domain.make_reader("rq/" + path + "Request", is_set_bool ? set_bool_request : trigger_request, choice),
                       domain.make_writer("rr/" + path + "Reply", is_set_bool ? set_bool_response : trigger_response, choice), is_set_bool,
                       std::move(call)});
}

void Services::look() {
  for (Service& s : services_) {
    const Entity::Handle requests = s.requests.get(), replies = s.replies.get();
    const auto once = [&] {
      if (s.is_set_bool)
        return answer_one<std_srvs_srv_dds__SetBool_Request_, std_srvs_srv_dds__SetBool_Response_>(
            requests, replies, [&](const auto& request) { return s.call(request.data); });
      return answer_one<std_srvs_srv_dds__Trigger_Request_, std_srvs_srv_dds__Trigger_Response_>(requests, replies,
                                                                                                 [&](const auto&) { return s.call(true); });
    };
    while (once()) {
    }
  }
}

}  // namespace kilvo::dds
