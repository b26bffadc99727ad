// Any text is a trajectory, exactly readable again once printed, or an error; never a crash.
#include <cstdlib>

#include "lab/evaluation/trajectory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kilvo::lab;
  try {
    std::string printed;
    const auto poses = parse_tum({reinterpret_cast<const char*>(data), size}, "fuzz");
    for (const StampedPose& pose : poses) append_tum_line(printed, pose);
    const auto again = parse_tum(printed, "printed");
    if (again.size() != poses.size()) std::abort();
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (again[i].t != poses[i].t) std::abort();
  } catch (const TrajectoryError&) {
  }
  return 0;
}
