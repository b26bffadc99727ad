// The coloured map against the world that was simulated: albedo times the light on each surface, as the first image would have shown it.
#include <cmath>
#include <gtest/gtest.h>

#include "kilvo/estimator/estimator.hpp"
#include "lab/mapping/map_builder.hpp"
#include "lab/settings/settings.hpp"
#include "lab/simulation/description.hpp"
#include "tests/helpers/simulated.hpp"

namespace kilvo {
namespace colours_test {

// Where a point lies on a surface (its edges' coordinates, m), and how far from it.
struct Place {
  double u, v, distance;
  bool within;  // by so much that nothing of its surroundings is seen
};

Place place_on(const lab::Surface& s, const Eigen::Vector3d& p, double margin) {
  const Eigen::Vector3d d = p - s.corner;
  const double u = d.dot(s.u.normalized()), v = d.dot(s.v.normalized()), across = s.normal().dot(d);
  const double du = std::max({0.0, -u, u - s.u.norm()}), dv = std::max({0.0, -v, v - s.v.norm()});
  const bool within = u > margin && v > margin && u < s.u.norm() - margin && v < s.v.norm() - margin;
  return {u, v, std::sqrt(across * across + du * du + dv * dv), within};
}

// The surface on which a point lies, if it lies on one and far from all others.
std::optional<lab::Hit> lone_surface(const lab::World& world, const Eigen::Vector3d& p) {
  constexpr double margin = 0.15, off = 0.04;  // m
  std::optional<lab::Hit> found;
  for (std::size_t i = 0; i < world.surfaces().size(); ++i) {
    const Place place = place_on(world.surfaces()[i], p, margin);
    if (place.distance > margin) continue;
    if (found || !place.within || place.distance > off) return std::nullopt;
    found = lab::Hit{3, i, place.u, place.v, 1};
  }
  return found;
}

// Grey levels of a surface, averaged over what a voxel and the pixels that colour it hold (`radius`, m).
Eigen::Vector3d colour_at(const lab::World& world, lab::Hit hit, double du, double dv, double radius, double brightness) {
  hit.u += du;
  hit.v += dv;
  return brightness * world.radiance(hit, Eigen::Vector2d(radius, 0), Eigen::Vector2d(0, radius), 1).cast<double>();
}

TEST(ColouredMap, IsAsBrightAsTheWorldWhereSurfacesAreFlatAndEven) {
  lab::SimulatorConfig config = test::only({Sensor::imu, Sensor::lidar, Sensor::camera}, 5);
  config.threads = 2;
  lab::Simulator simulator(test::scenario("room"), config);
  const lab::Settings settings =
      lab::parse_settings(lab::simulated_config(config, "sim.urdf"), "simulated", std::string(KILVO_SOURCE_DIR) + "/config/robots");
  Estimator estimator(settings.robot, settings.estimator, {true, false, true, true});
  lab::MapBuilder map;
  std::optional<SE3> T_RW;
  std::optional<double> brightness;  // of the first image used: grey levels of full reflectance
  const auto take = [&](const std::vector<Output>& outputs) {
    for (const Output& o : outputs) {
      const double t = simulator.seconds_of(o.t);
      if (!T_RW) T_RW = simulator.walk().imu(t) * o.x.pose().inverse();
      map.add(o.points_W);
      map.colour(o.coloured);
      if (o.is_image && !brightness) brightness = 255 * lab::exposure_at(config.camera, t) * config.camera.gain * o.x.tau;
    }
  };
  while (auto m = simulator.next()) take(estimator.push(*std::move(m)));
  take(estimator.finish());
  ASSERT_TRUE(brightness);

  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0;
  int points = 0;
  constexpr double radius = 0.025, even = 4;  // m, grey levels
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto rgb = map.colour_of(i);
    const auto hit = lone_surface(simulator.world(), *T_RW * map.point(i).head<3>().cast<double>());
    if (!rgb || !hit) continue;
    const Eigen::Vector3d truth = colour_at(simulator.world(), *hit, 0, 0, radius, *brightness);
    double change = 0;
    for (const auto& [du, dv] : {std::pair(0.05, 0.0), std::pair(-0.05, 0.0), std::pair(0.0, 0.05), std::pair(0.0, -0.05)})
      change = std::max(change, (colour_at(simulator.world(), *hit, du, dv, radius, *brightness) - truth).cwiseAbs().maxCoeff());
    if (change > even || truth.maxCoeff() > 245) continue;
    const Eigen::Vector3d error = Eigen::Vector3d((*rgb)[0], (*rgb)[1], (*rgb)[2]) - truth;
    sum += error;
    squares += error.squaredNorm() / 3;
    ++points;
  }
  EXPECT_GT(points, 500);
  const double rms = std::sqrt(squares / points), mean = (sum / points).mean();
  std::printf("coloured map: %d even points of %zu coloured ones, rms %.2f, mean %.2f grey levels\n", points, map.coloured(), rms, mean);
  EXPECT_LT(rms, 8) << "grey levels";
  EXPECT_LT(std::abs(mean), 3) << "grey levels";
}

}  // namespace colours_test
}  // namespace kilvo
