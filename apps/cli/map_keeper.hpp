// Keeps the map up to date on a thread of its own, so that the estimator need not wait for it.
#pragma once

#include <exception>
#include <thread>
#include <variant>
#include <vector>

#include "apps/cli/bounded_queue.hpp"
#include "lab/mapping/map_builder.hpp"

namespace kilvo::cli {

class MapKeeper {
 public:
  /// Without a thread of its own, `threaded` false, add() and colour() do the work themselves. The map is the same.
  MapKeeper(const lab::MappingConfig& config, bool threaded);
  ~MapKeeper();
  MapKeeper(const MapKeeper&) = delete;
  MapKeeper& operator=(const MapKeeper&) = delete;

  /// In the order of the calls: an image colours what was there before it.
  void add(std::vector<Eigen::Vector4f> points_W);
  void colour(std::vector<ColouredPoint> points);
  /// Waits until everything is in; nothing may be added afterwards.
  const lab::MapBuilder& finish();

 private:
  using Item = std::variant<std::vector<Eigen::Vector4f>, std::vector<ColouredPoint>>;
  void take(Item item);
  void put(const Item& item);
  void put_all();
  void join();

  lab::MapBuilder map_;
  BoundedQueue<Item> queue_;
  std::exception_ptr error_;  // of the thread; read after it has ended
  std::thread thread_;
};

}  // namespace kilvo::cli
