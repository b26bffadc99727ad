// What stood in the way and has left: its planes go, those of the walls stay.
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <vector>

#include "kilvo/estimator/estimator.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo {
namespace leavers_test {

constexpr double arrives = 2, watched = 2;  // s

/// An upright cylinder on the ground, there from `arrives` until `leaves`.
struct Visitor {
  const char* name;
  double radius, height, leaves;  // m, m, s
};
constexpr Visitor person = {"person", 0.22, 1.7, arrives + 5}, box = {"box", 0.3, 1.0, arrives + 3};

/// A walk with a visitor, which the sweeps of the simulator get to see; and what the map holds of it and of all else.
class Visit {
 public:
  Visit(const char* walk, int points, const Visitor& visitor)
      : visitor_(visitor), simulator_(test::scenario(walk), config_of(points, visitor)) {
    settings_ = lab::parse_settings(lab::simulated_config(config_of(points, visitor), "sim.urdf"), "simulated",
                                    std::string(KILVO_SOURCE_DIR) + "/config/robots");
    const SE3 first = simulator_.walk().imu(arrives);
    // Two metres off towards the middle of the room; beside the path if there is one.
    const Eigen::Vector3d inwards = Eigen::Vector3d(-first.p.x(), -first.p.y(), 0).normalized();
    centre_ = first.p + 2 * inwards;
    if (std::string(walk) != "stand") centre_ += Eigen::Vector3d(-inwards.y(), inwards.x(), 0);
    centre_.z() = 0;
  }

  /// Places of the visitor's surface, and of what the last sweep hit, that the map has planes at.
  struct Share {
    int there = 0, all = 0;
  };
  Share visitor_when_it_leaves, visitor_at_the_end, walls_at_the_end;

  void run() {
    Estimator estimator(settings_.robot, settings_.estimator, {true, false, true, false});
    std::optional<SE3> T_WR;
    bool has_left = false;
    std::vector<Eigen::Vector3d> last_hits;
    while (auto m = simulator_.next()) {
      const double s = simulator_.seconds_of(stamp_of(*m));
      if (!has_left && s >= visitor_.leaves) {
        has_left = true;
        visitor_when_it_leaves = visitor_in(estimator.map(), *T_WR, s);
      }
      if (auto* scan = std::get_if<LidarScan>(&*m)) last_hits = meet(*scan, s);
      for (const Output& o : estimator.push(*std::move(m))) {
        if (!T_WR) T_WR = o.x.pose() * simulator_.walk().imu(simulator_.seconds_of(o.t)).inverse();
      }
    }
    visitor_at_the_end = visitor_in(estimator.map(), *T_WR, visitor_.leaves + watched);
    for (const Eigen::Vector3d& x : last_hits) count(walls_at_the_end, has_plane_at(estimator.map(), *T_WR * x, [](auto) { return true; }));
  }

 private:
  static lab::SimulatorConfig config_of(int points, const Visitor& visitor) {
    lab::SimulatorConfig config = test::only({Sensor::imu, Sensor::lidar}, visitor.leaves + watched);
    config.lidar.points = points;
    return config;
  }
  static void count(Share& share, bool there) {
    ++share.all;
    share.there += there ? 1 : 0;
  }
  template <class F>
  static bool has_plane_at(const VoxelMap& map, const Eigen::Vector3d& x_W, F&& is_of_it) {
    constexpr double near = 0.06;  // m
    bool out = false;
    map.visit_planes(x_W, [&](const VoxelMap::Match& m) {
      return out = std::abs(m.plane->distance(x_W)) < near && is_of_it(m.plane->normal.template cast<double>());
    });
    return out;
  }

  // The points of a scan where the truth has them, in the simulator's world; those that the visitor is before are brought to it.
  std::vector<Eigen::Vector3d> meet(LidarScan& scan, double s) {
    std::vector<Eigen::Vector3d> out;
    for (LidarPoint& p : scan.points) {
      const SE3 T = simulator_.walk().imu(s + 1e-9 * p.offset_ns) * settings_.robot.lidar.T_imu_lidar;
      const Eigen::Vector3d way = T.R * Eigen::Vector3d(p.x, p.y, p.z);
      if (way.norm() < 0.1) continue;
      const double share = s >= arrives && s < visitor_.leaves ? met_after(T.p, way) : 1;
      p.x *= static_cast<float>(share), p.y *= static_cast<float>(share), p.z *= static_cast<float>(share);
      out.push_back(T.p + share * way);
    }
    return out;
  }
  // Which share of the way from `from` leads to the visitor; 1 when it is not met.
  double met_after(const Eigen::Vector3d& from, const Eigen::Vector3d& way) const {
    const Eigen::Vector2d o = (from - centre_).head<2>(), w = way.head<2>();
    const double a = w.squaredNorm(), b = o.dot(w), c = o.squaredNorm() - visitor_.radius * visitor_.radius, d = b * b - a * c;
    if (d < 0 || a < 1e-9) return 1;
    const double share = (-b - std::sqrt(d)) / a, z = from.z() + share * way.z();
    return share > 0 && share < 1 && z > 0 && z < visitor_.height ? share : 1;
  }
  // Upright planes on the side that faces the robot.
  Share visitor_in(const VoxelMap& map, const SE3& T_WR, double s) const {
    Share out;
    const Eigen::Vector2d towards = (simulator_.walk().imu(s).p - centre_).head<2>().normalized();
    for (double angle = 0; angle < 2 * M_PI; angle += 0.2) {
      const Eigen::Vector3d outwards(std::cos(angle), std::sin(angle), 0);
      if (towards.dot(outwards.head<2>()) < 0.2) continue;
      for (double z = 0.15; z < visitor_.height; z += 0.1) {
        const Eigen::Vector3d x = centre_ + visitor_.radius * outwards + Eigen::Vector3d(0, 0, z);
        const auto is_upright = [&](const Eigen::Vector3d& normal_W) { return std::abs((T_WR.R.inverse() * normal_W).z()) < 0.5; };
        count(out, has_plane_at(map, T_WR * x, is_upright));
      }
    }
    return out;
  }

  Visitor visitor_;
  lab::Simulator simulator_;
  lab::Settings settings_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
};

struct Case {
  const char* walk;
  int points;
  Visitor visitor;
  double most_left;  // share of the places
};

class Leavers : public testing::TestWithParam<Case> {};

TEST_P(Leavers, LeaveNoPlaneTwoSecondsLaterAndTheWallsStay) {
  const auto& [walk, points, visitor, most_left] = GetParam();
  Visit visit(walk, points, visitor);
  visit.run();
  const auto &then = visit.visitor_when_it_leaves, &now = visit.visitor_at_the_end, &walls = visit.walls_at_the_end;
  std::printf("%s, %s, %d points: planes at %d of %d places when it leaves, at %d of %d after 2 s; walls %d of %d\n", walk, visitor.name,
              points, then.there, then.all, now.there, now.all, walls.there, walls.all);
  EXPECT_GT(then.there, then.all / 3) << "or nothing is to be forgotten";
  EXPECT_LE(now.there, most_left * now.all);
  EXPECT_GT(walls.there, 0.89 * walls.all);
}

// A box of 20 000 points keeps a strip at its side, which beams graze, and a person those parts that a robot that walks sees it cover.
INSTANTIATE_TEST_SUITE_P(All, Leavers,
                         testing::Values(Case{"stand", 4000, person, 0}, Case{"stand", 20000, person, 0}, Case{"stand", 20000, box, 0.05},
                                         Case{"stand", 4000, box, 0}, Case{"room", 4000, person, 0.05}, Case{"room", 20000, person, 0.08},
                                         Case{"room", 20000, box, 0.05}));

}  // namespace leavers_test
}  // namespace kilvo
