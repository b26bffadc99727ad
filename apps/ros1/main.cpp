// kilvo_node: KILVO for ROS 1.
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <fmt/core.h>
#include <optional>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/node_handle.h>
#include <stop_token>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "apps/ros1/node.hpp"

namespace {

using namespace kilvo;

enum ExitCode : int { done = 0, run_failed = 1, wrong_usage = 2 };

/// SIGINT and SIGTERM as a question that the main thread asks. Made before any other thread, so that none of them takes the signal.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }
  /// Waits for one, or for so long, ns below a second.
  bool came_within(long nanoseconds) const {
    const timespec time{0, nanoseconds};
    return sigtimedwait(&signals_, nullptr, &time) >= 0;
  }

 private:
  sigset_t signals_{};
};

/// The command line, without the parameters on it: with these ros::init would wait for a master, deaf to signals.
class CommandLine {
 public:
  CommandLine(int argc, char** argv) : words_(argv, argv + argc) {
    std::erase_if(words_, [this](const char* word) {
      const std::string_view text = word;
      const std::size_t sign = text.find(":=");
      const bool is_parameter = sign != std::string_view::npos && text.starts_with('_') && !text.starts_with("__");
      if (is_parameter) parameters_.emplace_back(text.substr(1, sign - 1), text.substr(sign + 2));
      return is_parameter;
    });
  }

  /// Throws ParameterError when there is something that ROS does not understand either.
  void init_ros() {
    int argc = static_cast<int>(words_.size());
    words_.push_back(nullptr);
    ros::init(argc, words_.data(), "kilvo", ros::init_options::NoSigintHandler);
    if (argc > 1)
      throw ros1::ParameterError(
          fmt::format("'{}' is not understood: parameters are given as _config:=FILE, or by a launch file", words_[1]));
  }

  /// As ros::init would have done it.
  void set_parameters(const ros::NodeHandle& own) const {
    for (const auto& [name, value] : parameters_) {
      double number = 0;
      const char* end = value.data() + value.size();
      const auto [rest, error] = std::from_chars(value.data(), end, number);
      if (value == "true" || value == "false") {
        own.setParam(name, value == "true");
      } else if (error == std::errc() && rest == end) {
        own.setParam(name, number);
      } else {
        own.setParam(name, value);
      }
    }
  }

 private:
  std::vector<char*> words_;
  std::vector<std::pair<std::string, std::string>> parameters_;
};

// Without a master there are no parameters to read.
bool wait_for_master(const StopSignals& stop) {
  constexpr int tries_a_message = 50;
  for (int tried = 0; !ros::master::check(); ++tried) {
    if (tried % tries_a_message == 0)
      fmt::print(stderr, "kilvo_node: waiting for a ROS master at {} (is roscore running?)\n", ros::master::getURI());
    if (stop.came_within(200'000'000)) return false;
  }
  return true;
}

/// While ROS tries again and again to reach a master that has gone in the middle of the start, nobody asks for signals: the program ends
/// here and now.
class StartWatch {
 public:
  explicit StartWatch(const StopSignals& stop)
      : thread_([&stop](const std::stop_token& started) {
          while (!started.stop_requested()) {
            if (stop.came_within(50'000'000)) std::_Exit(done);
          }
        }) {}

 private:
  std::jthread thread_;
};

int run(int argc, char** argv) {
  const StopSignals stop;
  CommandLine words(argc, argv);
  words.init_ros();
  if (!wait_for_master(stop)) return done;
  std::optional<StartWatch> start(stop);
  ros::NodeHandle node, own("~");
  words.set_parameters(own);
  const ros1::Parameters parameters = ros1::read_parameters(own);
  {
    ros1::Node kilvo(parameters, node::load_settings(parameters.options.config, parameters.overrides));
    start.reset();
    while (ros::ok() && !stop.came_within(100'000'000)) kilvo.tick();
  }
  ros::shutdown();
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const kilvo::ros1::ParameterError& error) {
    fmt::print(stderr, "kilvo_node: {}\n", error.what());
    return wrong_usage;
  } catch (const kilvo::lab::ConfigError& error) {
    fmt::print(stderr, "kilvo_node: {}\n", error.what());
    return wrong_usage;
  } catch (const std::exception& error) {
    fmt::print(stderr, "kilvo_node: {}\n", error.what());
    return run_failed;
  }
}
