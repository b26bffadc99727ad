// The topics that the configuration names, in DDS: who publishes them, messages of any type that a sensor may come as.
#pragma once

#include <atomic>
#include <list>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "apps/dds/domain.hpp"
#include "apps/node/sensor_inputs.hpp"

namespace kilvo::dds {

class DdsInputs {
 public:
  /// Looks for the topics of the sensors that the settings have; `domain` and `inputs` must outlive it.
  DdsInputs(const Domain& domain, const lab::Settings& settings, node::SensorInputs& inputs);
  ~DdsInputs() { stop(); }
  DdsInputs(const DdsInputs&) = delete;
  DdsInputs& operator=(const DdsInputs&) = delete;

  /// Nothing is received afterwards.
  void stop();

 private:
  struct Subscription;
  struct Reader {  // of one type
    const DdsType* type;
    Entity entity;
    Subscription* subscription;
  };
  struct Subscription {
    std::string topic;            // on the wire
    std::vector<Sensor> sensors;  // that it is configured for: a LowState is the IMU's and the legs'
    bool is_compressed = false;
    bool is_quick = false;
    std::list<Reader> readers;
    std::map<std::string, std::string> misfits;  // of publishers that are there: why they cannot be heard
  };
  struct Publisher;  // as discovery describes it

  void subscribe(Sensor sensor, const std::string& topic, bool is_compressed);
  void run_discovery();
  void discover();
  void note(const Publisher& publisher, bool is_alive);
  std::string misfit_of(Subscription& subscription, const Publisher& publisher);
  void listen_to(Subscription& subscription, const DdsType& type);
  void run_readers(const Entity& waitset);
  void take(Reader& reader);

  const Domain& domain_;
  node::SensorInputs& inputs_;
  std::list<Subscription> subscriptions_;
  Entity publications_, stop_, discovery_, quick_, slow_;  // a reader, a condition, and a waitset for each thread
  std::atomic<bool> stopping_{false};
  std::vector<std::thread> threads_;  // last: they use all of the above
};

}  // namespace kilvo::dds
