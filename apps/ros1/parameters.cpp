#include "apps/ros1/parameters.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "lab/settings/nearest.hpp"

namespace kilvo::ros1 {
namespace {

/// Reads the parameters of one node, and knows afterwards which ones nobody has asked for.
class Reader {
 public:
  explicit Reader(const ros::NodeHandle& own) : own_(own) {}

  bool get(const std::string& name, XmlRpc::XmlRpcValue& value) {
    known_.push_back(name);
    return own_.getParam(name, value);
  }

  std::string text(const std::string& name, const std::string& otherwise) {
    XmlRpc::XmlRpcValue value;
    if (!get(name, value)) return otherwise;
    if (value.getType() != XmlRpc::XmlRpcValue::TypeString) throw wrong(name, "must be a text");
    return static_cast<std::string>(value);
  }

  std::string one_of(const std::string& name, const std::vector<std::string>& choices) {
    std::string given = text(name, choices.front());
    if (std::ranges::find(choices, given) != choices.end()) return given;
    std::string all;
    for (const std::string& choice : choices) all += (all.empty() ? "'" : ", '") + choice + "'";
    throw wrong(name, fmt::format("is '{}' but must be one of {}", given, all));
  }

  /// The name of a frame: without the leading slash that tf does not want.
  std::string frame(const std::string& name, const std::string& otherwise) {
    std::string given = text(name, otherwise);
    if (given.starts_with('/')) given.erase(0, 1);
    if (given.empty()) throw wrong(name, "must name a frame");
    return given;
  }

  bool flag(const std::string& name) {
    XmlRpc::XmlRpcValue value;
    if (!get(name, value)) return false;
    if (value.getType() != XmlRpc::XmlRpcValue::TypeBoolean) throw wrong(name, "must be true or false");
    return static_cast<bool>(value);
  }

  double number(const std::string& name, double otherwise, double low, double high) {
    XmlRpc::XmlRpcValue value;
    if (!get(name, value)) return otherwise;
    double out = std::nan("");
    if (value.getType() == XmlRpc::XmlRpcValue::TypeDouble) out = static_cast<double>(value);
    if (value.getType() == XmlRpc::XmlRpcValue::TypeInt) out = static_cast<int>(value);
    if (!(out >= low && out <= high)) throw wrong(name, fmt::format("must be a number from {} to {}", low, high));
    return out;
  }

  /// A list of texts, or a single one.
  std::vector<std::string> texts(const std::string& name) {
    XmlRpc::XmlRpcValue value;
    if (!get(name, value)) return {};
    if (value.getType() == XmlRpc::XmlRpcValue::TypeString) return {static_cast<std::string>(value)};
    if (value.getType() != XmlRpc::XmlRpcValue::TypeArray) throw wrong(name, "must be a list of texts KEY=VALUE");
    std::vector<std::string> out;
    for (int i = 0; i < value.size(); ++i) {
      if (value[i].getType() != XmlRpc::XmlRpcValue::TypeString) throw wrong(name, "must be a list of texts KEY=VALUE");
      out.push_back(static_cast<std::string>(value[i]));
    }
    return out;
  }

  void refuse_unknown() const {
    std::vector<std::string> all;
    own_.getParamNames(all);
    const std::string prefix = own_.getNamespace() + "/";
    for (const std::string& full : all) {
      if (!full.starts_with(prefix)) continue;
      const std::string name = full.substr(prefix.size(), full.find('/', prefix.size()) - prefix.size());
      if (std::ranges::find(known_, name) == known_.end())
        throw wrong(name, fmt::format("is no parameter of this node, the nearest is ~{}", lab::nearest(name, known_)));
    }
  }

  static ParameterError wrong(const std::string& name, const std::string& what) {
    return ParameterError(fmt::format("parameter ~{} {}", name, what));
  }

 private:
  const ros::NodeHandle& own_;
  std::vector<std::string> known_;
};

// What users of FAST-LIO have wired up: one world, whose corrections are steps, and the IMU as the body.
void name_as_fast_lio(Parameters& p) {
  p.options.map_frame = p.options.odom_frame = "camera_init";
  p.options.base = "imu";
  p.options.base_frame = "body";
  p.names.of(node::Topic::odometry) = "/Odometry";
  p.names.of(node::Topic::path) = "/path";
  p.names.of(node::Topic::cloud) = "/cloud_registered";
}

}  // namespace

Names::Names() {
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string name = node::topic_facts[i].name;
    names[i] = name.starts_with('/') ? name : "~" + name;
  }
}

Parameters read_parameters(const ros::NodeHandle& own) {
  Reader reader(own);
  Parameters out;
  node::Options& options = out.options;
  options.config = reader.text("config", "");
  out.overrides = reader.texts("set");
  if (reader.one_of("compat", {"", "fast_lio"}) == "fast_lio") name_as_fast_lio(out);
  options.map_frame = reader.frame("map_frame", options.map_frame);
  options.odom_frame = reader.frame("odom_frame", options.odom_frame);
  options.base = reader.text("base", options.base);
  options.base_frame = reader.text("base_frame", options.base_frame);
  if (options.base_frame.starts_with('/')) options.base_frame.erase(0, 1);
  options.no_deskew = reader.flag("no_deskew");
  options.tf_rate = reader.number("tf_rate", options.tf_rate, 1, 1000);
  options.map_file = reader.text("map_file", options.map_file);
  reader.refuse_unknown();
  if (options.config.empty()) throw Reader::wrong("config", "is missing: the path of a configuration file, such as config/robots/g1.yaml");
  if (options.map_file.empty()) throw Reader::wrong("map_file", "must be the path of a file");
  const std::string& frame = options.base_frame;
  if (!frame.empty() && (frame == options.odom_frame || frame == options.map_frame))
    throw Reader::wrong("base_frame", fmt::format("is '{}', as is the frame that it moves in", frame));
  return out;
}

}  // namespace kilvo::ros1
