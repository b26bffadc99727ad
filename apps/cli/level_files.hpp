// The files of a run in one level world from the first row on: until gravity is known, outputs wait.
#pragma once

#include <deque>
#include <optional>

#include "apps/cli/held_output.hpp"
#include "apps/cli/result_files.hpp"
#include "apps/live/levelling.hpp"

namespace kilvo::cli {

class LevelFiles {
 public:
  /// `files` must outlive it. `gravity_align`: the setting; without it nothing waits, and nothing is turned.
  LevelFiles(ResultFiles& files, bool gravity_align) : files_(files), gravity_align_(gravity_align) {}

  /// Of an estimator, in their order: looks whether gravity is known by it. hold() has to follow.
  void look(Output& output);
  /// An output, or what a live runner gives of it, which levels its outputs itself: for that the files wait 20 s.
  void hold(const Output& output, HeldOutput::Part part);
  /// No more outputs come.
  void finish();

  /// By which the world as it began is turned in the files; none while that is not known.
  const std::optional<SO3>& turn() const { return turn_; }
  /// What was reported of it.
  const std::optional<Event>& event() const { return event_; }

 private:
  void write(const Output& output, HeldOutput::Part part);
  void write_waiting();

  ResultFiles& files_;
  bool gravity_align_;
  Levelling levelling_;
  std::optional<Time> first_;
  std::optional<SO3> turn_;
  std::optional<Event> event_;
  std::deque<HeldOutput> waiting_;
};

}  // namespace kilvo::cli
