#include "lab/recordings/joined_reader.hpp"

#include <algorithm>
#include <set>

namespace kilvo::lab {

JoinedReader::JoinedReader(std::string name, std::vector<std::unique_ptr<RecordingReader>> parts, std::vector<Damage> damages)
    : name_(std::move(name)), damages_(std::move(damages)) {
  std::ranges::stable_sort(parts, {}, [](const auto& part) { return part->begin(); });
  bool any = false;
  for (auto& reader : parts) {
    Part part;
    part.reader = std::move(reader);
    add_channels(part);
    gather_damages(part);
    if (!part.reader->times().empty()) {
      begin_ = any ? std::min(begin_, part.reader->begin()) : part.reader->begin();
      end_ = any ? std::max(end_, part.reader->end()) : part.reader->end();
      any = true;
    }
    parts_.push_back(std::move(part));
  }
}

/// A topic of the same type and encoding is the same channel in every part.
void JoinedReader::add_channels(Part& part) {
  for (const auto& [id, theirs] : part.reader->connections()) {
    const Channel& channel = theirs;
    auto known = std::ranges::find_if(connections_, [&](const auto& entry) {
      const Channel& c = entry.second;
      return c.topic == channel.topic && c.type == channel.type && c.encoding == channel.encoding;
    });
    if (known == connections_.end()) {
      if (connections_.size() >= most_connections) continue;
      Channel ours = channel;
      ours.id = static_cast<std::uint32_t>(connections_.size());
      known = connections_.emplace(ours.id, std::move(ours)).first;
    }
    part.ids[id] = known->first;
    const auto times = part.reader->times().find(id);
    if (times != part.reader->times().end()) times_[known->first].append(times->second);
  }
}

std::uint64_t JoinedReader::file_size() const {
  std::uint64_t bytes = 0;
  for (const Part& part : parts_) bytes += part.reader->file_size();
  return bytes;
}

StorageSummary JoinedReader::storage() const {
  StorageSummary all;
  std::set<std::string> formats, compressions;
  for (const Part& part : parts_) {
    const StorageSummary one = part.reader->storage();
    formats.insert(one.format);
    compressions.insert(one.compression);
    all.chunks += one.chunks;
  }
  for (const auto& format : formats) all.format += (all.format.empty() ? "" : ", ") + format;
  for (const auto& compression : compressions) all.compression += (all.compression.empty() ? "" : " ") + compression;
  if (parts_.size() > 1) all.format += ", " + std::to_string(parts_.size()) + " files";
  return all;
}

void JoinedReader::select(const std::function<bool(const Channel&)>& wanted, Time from, Time until) {
  for (Part& part : parts_) {
    // The caller knows channels by the identifiers of this reader, not by those of the part.
    const auto is_wanted = [&](const Channel& theirs) {
      const auto ours = part.ids.find(theirs.id);
      return ours != part.ids.end() && wanted(connections_.at(ours->second));
    };
    part.reader->select(is_wanted, from, until);
    part.head.reset();
    part.started = false;
  }
  from_ = from;
  last_ = nullptr;
}

void JoinedReader::gather_damages(Part& part) {
  const auto& all = part.reader->damages();
  for (; part.damages < all.size() && damages_.size() < most_damages; ++part.damages) {
    Damage damage = all[part.damages];
    if (damage.file.empty()) damage.file = part.reader->name();
    damages_.push_back(std::move(damage));
  }
}

void JoinedReader::advance(Part& part) {
  part.started = true;
  part.head = part.reader->next();
  gather_damages(part);
}

/// The part with the earliest message. A part is not begun before one that it could be of is due.
JoinedReader::Part* JoinedReader::due() {
  Part* first = nullptr;
  for (Part& part : parts_) {
    if (!part.started && (first == nullptr || part.reader->begin() <= first->head->time)) advance(part);
    if (part.head && (first == nullptr || part.head->time < first->head->time)) first = &part;
  }
  return first;
}

std::optional<RawMessage> JoinedReader::next() {
  if (last_ != nullptr) advance(*last_);  // not earlier: its bytes had to stay
  last_ = due();
  if (last_ == nullptr) return std::nullopt;
  RawMessage message = *last_->head;
  message.connection = &connections_.at(last_->ids.at(message.connection->id));
  return message;
}

std::uint64_t JoinedReader::late_messages() const {
  std::uint64_t late = 0;
  for (const Part& part : parts_) late += part.reader->late_messages();
  return late;
}

double JoinedReader::progress() const {
  double sum = 0;
  for (const Part& part : parts_) sum += part.started ? part.reader->progress() : 0;
  return parts_.empty() ? 1 : sum / static_cast<double>(parts_.size());
}

}  // namespace kilvo::lab
