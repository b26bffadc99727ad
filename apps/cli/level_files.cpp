#include "apps/cli/level_files.hpp"

namespace kilvo::cli {

void LevelFiles::look(Output& output) {
  if (gravity_align_) levelling_.add(output);
  turn_ = levelling_.turn();
}

void LevelFiles::hold(const Output& output, HeldOutput::Part part) {
  constexpr Duration longest = std::chrono::seconds(20);
  if (!first_) first_ = output.t;
  if (!turn_ && output.R_LW) turn_ = output.R_LW;
  if (!turn_ && gravity_align_ && output.t - *first_ > longest) turn_ = SO3();
  for (const Event& event : output.events) {
    if (event.reason == Reason::levelled) event_ = event;
  }
  const bool may_write = !gravity_align_ || turn_;
  const bool is_as_written = !turn_ || (output.R_LW && output.R_LW->matrix() == turn_->matrix());
  if (may_write && is_as_written && waiting_.empty()) return write(output, part);
  waiting_.emplace_back(output, part);
  if (may_write) write_waiting();
}

void LevelFiles::write(const Output& output, HeldOutput::Part part) {
  if (part != HeldOutput::Part::sweep) files_.write_state(output);
  if (part != HeldOutput::Part::state) files_.write_sweep(output);
}

void LevelFiles::finish() {
  // What a live runner has not turned stays as it was answered.
  const bool is_late = !turn_;
  if (is_late) event_ = levelling_.finish();
  if (is_late) turn_ = levelling_.turn();
  write_waiting();
  if (is_late && event_) files_.write_events({*event_});
}

// All of them in one world: one that a live runner has turned later than the files could wait is turned back.
void LevelFiles::write_waiting() {
  for (const HeldOutput& held : waiting_) {
    Output output = held.output();
    if (turn_ && !output.R_LW) {
      Levelling::apply(*turn_, output);
    } else if (turn_ && output.R_LW->matrix() != turn_->matrix()) {
      Levelling::apply(*turn_ * output.R_LW->inverse(), output);
    }
    write(output, held.part());
  }
  waiting_.clear();
}

}  // namespace kilvo::cli
