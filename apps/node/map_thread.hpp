// What takes time and nobody waits for: sweeps and images become clouds for others and the map that is saved, on a thread of its own.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "apps/node/outlet.hpp"
#include "kilvo/estimator/output.hpp"
#include "lab/mapping/map_builder.hpp"

namespace kilvo::node {

class MapThread {
 public:
  /// `frame`: of the world, for the clouds.
  MapThread(std::string frame, const lab::MappingConfig& config, Outlet outlet);
  ~MapThread();
  MapThread(const MapThread&) = delete;
  MapThread& operator=(const MapThread&) = delete;

  /// An output of a sweep or an image. Never waits; the oldest are given up when too many wait.
  void take(Output output);

  /// Writes the map of all sweeps until now; how many points it has. Throws lab::OutputError.
  std::size_t save(const std::string& path);

  /// Begins an empty map.
  void clear();

  std::uint64_t given_up() const;

 private:
  void run();
  void put(Output output);

  lab::MappingConfig config_;
  std::string frame_;
  Outlet outlet_;

  mutable std::mutex waiting_mutex_;
  std::condition_variable news_;
  std::deque<Output> waiting_;
  std::uint64_t given_up_ = 0;
  bool ended_ = false;

  std::mutex map_mutex_;
  std::uint32_t epoch_ = 0;
  lab::MapBuilder map_;      // in the world as it began
  std::optional<SO3> turn_;  // that has levelled it
  std::thread thread_;       // last: it uses all of the above
};

}  // namespace kilvo::node
