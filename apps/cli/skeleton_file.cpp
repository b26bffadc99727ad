#include "apps/cli/skeleton_file.hpp"

#include <fmt/format.h>
#include <stdexcept>

#include "lab/evaluation/decimal_time.hpp"

namespace kilvo::cli {
namespace {

constexpr Duration period = std::chrono::milliseconds(50);

}  // namespace

SkeletonFile::SkeletonFile(std::filesystem::path file, const Robot& robot) : path_(std::move(file)), T_IM_(robot.imu.T_link_imu.inverse()) {
  if (robot.urdf.empty() || robot.legs.type != "joints" || robot.imu.link.empty()) return;
  try {
    const LinkTree tree(robot);
    chains_ = {tree.chain(robot.imu.link, robot.feet[0].link), tree.chain(robot.imu.link, robot.feet[1].link)};
  } catch (const std::invalid_argument&) {
    chains_.reset();  // without legs nobody asked for the URDF to be right
  }
}

bool SkeletonFile::look_up(const JointSample& sample) {
  if (sample.names != names_ || names_.empty()) {
    names_ = sample.names;
    found_ = !names_.empty() && !(*chains_)[0].look_up(names_) && !(*chains_)[1].look_up(names_);
  }
  return found_ && sample.position.size() == names_.size();
}

void SkeletonFile::write_header(const JointSample& sample) {
  std::string header = "t";
  for (std::size_t side = 0; side < 2; ++side) {
    const std::size_t count = (*chains_)[side].places_of_joints(sample.position).size() + 1;
    for (std::size_t i = 0; i < count; ++i) {
      for (const char axis : {'x', 'y', 'z'}) header += fmt::format(",{}_{}_{}", side == 0 ? "left" : "right", i, axis);
    }
  }
  file_ = std::make_unique<CsvFile>(path_, header);
}

void SkeletonFile::add(const Measurement& m) {
  const auto* sample = std::get_if<JointSample>(&m);
  if (sample == nullptr || !chains_ || (last_ && sample->t < *last_ + period) || !look_up(*sample)) return;
  if (!file_) write_header(*sample);
  std::string line;
  lab::append_seconds(line, sample->t);
  bool finite = true;
  for (const JointChain& chain : *chains_) {
    std::vector<Eigen::Vector3d> places = chain.places_of_joints(sample->position);
    places.insert(places.begin(), Eigen::Vector3d::Zero());
    for (const Eigen::Vector3d& place : places) {
      const Eigen::Vector3d p_I = T_IM_ * place;
      finite = finite && p_I.allFinite();
      fmt::format_to(std::back_inserter(line), ",{:.4f},{:.4f},{:.4f}", p_I.x(), p_I.y(), p_I.z());
    }
  }
  if (!finite) return;
  file_->write(line);
  last_ = sample->t;
}

void SkeletonFile::close() {
  if (file_) file_->close();
}

}  // namespace kilvo::cli
