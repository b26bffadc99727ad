// Several recordings as one: their messages by the time of their recording.
#pragma once

#include <memory>

#include "lab/recordings/recording_reader.hpp"

namespace kilvo::lab {

class JoinedReader final : public RecordingReader {
 public:
  /// `name`: what messages call it. Of messages recorded at the same time those of the earlier part come first.
  JoinedReader(std::string name, std::vector<std::unique_ptr<RecordingReader>> parts, std::vector<Damage> damages);

  const std::string& name() const override { return name_; }
  std::uint64_t file_size() const override;
  StorageSummary storage() const override;
  const std::map<std::uint32_t, Channel>& connections() const override { return connections_; }
  const std::map<std::uint32_t, TimesSummary>& times() const override { return times_; }
  Time begin() const override { return begin_; }
  Time end() const override { return end_; }
  void select(const std::function<bool(const Channel&)>& wanted, Time from = Time::min(), Time until = Time::max()) override;
  std::optional<RawMessage> next() override;
  const std::vector<Damage>& damages() const override { return damages_; }
  std::uint64_t late_messages() const override;
  double progress() const override;

 private:
  struct Part {
    std::unique_ptr<RecordingReader> reader;
    std::map<std::uint32_t, std::uint32_t> ids;  // of its channels -> of ours
    std::optional<RawMessage> head;
    bool started = false;
    std::size_t damages = 0;  // that we have of it
  };

  void add_channels(Part& part);
  void advance(Part& part);
  void gather_damages(Part& part);
  Part* due();

  std::string name_;
  std::vector<Part> parts_;
  std::map<std::uint32_t, Channel> connections_;
  std::map<std::uint32_t, TimesSummary> times_;
  std::vector<Damage> damages_;
  Time begin_{}, end_{}, from_ = Time::min();
  Part* last_ = nullptr;  // whose head was given
};

}  // namespace kilvo::lab
