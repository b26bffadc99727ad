#include "kilvo/legs/level_ground.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kilvo {
namespace {

// Before anything is known: ground is level; slopes, and what descriptions make of m, standard deviations.
constexpr double usually_level = 0.8, usual_slope = 0.087, usual_climb = 0.007;
// After so many metres one kind of ground may follow another; what a slope changes by on one metre.
constexpr double length_of_ground = 15, bend = 0.01;
// A kerb or a stair: so likely at a step, and anywhere within so many metres.
constexpr double stair_probability = 0.01, stair_range = 0.4;
// One standard deviation of what is wrong about its height.
constexpr double wrong_share = 0.5;
// As level as this ground is used, and no longer when less than this.
constexpr double surely_level = 0.95, hardly_level = 0.5;
// Floors are not more even than this; nor is a step measured better than this, m.
constexpr double least_noise = 0.01, least_step_noise = 0.001;
// What is higher or lower than that is another floor, m.
constexpr double same_floor = 0.03;
// Walking on level ground shows the vertical within so long. The first two feet that come down are those on which the robot stands.
constexpr Duration longest_search = std::chrono::seconds(14);
constexpr std::size_t touchdowns_of_a_walk = 3;
constexpr double least_probability = 1e-6;

}  // namespace

LevelGround::LevelGround() : noise_(0, 0.01, 10, 50) {
  level_.probability = usually_level;
  level_.mean.setZero();
  level_.P.setZero();
  level_.P.diagonal().head<3>().setConstant(usual_climb * usual_climb);
  sloped_ = level_;
  sloped_.probability = 1 - usually_level;
  sloped_.P.diagonal().tail<3>().setConstant(usual_slope * usual_slope);
}

void LevelGround::restart() {
  last_.reset();
  has_come_down_.reset();
  floor_.reset();
  is_level_ = false;
  has_left_floor_ = true;
}

double LevelGround::step_variance() const { return std::max(least_step_noise * least_step_noise, noise_.variance()); }

// One Gaussian for two.
LevelGround::Hypothesis LevelGround::mix(const Hypothesis& a, const Hypothesis& b) {
  Hypothesis out{a.probability + b.probability, {}, Matrix::Zero()};
  out.mean = (a.probability * a.mean + b.probability * b.mean) / out.probability;
  for (const Hypothesis* h : {&a, &b}) {
    const Vector off = h->mean - out.mean;
    out.P += h->probability / out.probability * (h->P + off * off.transpose());
  }
  return out;
}

void LevelGround::predict(double way) {
  const double change = std::min(0.5, way / length_of_ground);
  // A slope is gone where it ends; the robot and the plane stay as they are.
  const auto on_other_ground = [](Hypothesis h, double probability, double slope) {
    h.probability *= probability;
    h.mean.tail<3>().setZero();
    h.P.rightCols<3>().setZero();
    h.P.bottomRows<3>().setZero();
    h.P.diagonal().tail<3>().setConstant(slope * slope);
    return h;
  };
  const Hypothesis becomes_level = on_other_ground(sloped_, change * usually_level, 0);
  const Hypothesis becomes_sloped = on_other_ground(level_, change * (1 - usually_level), usual_slope);
  level_.probability -= becomes_sloped.probability;
  sloped_.probability -= becomes_level.probability;
  sloped_.P.diagonal().tail<3>().array() += bend * bend * way;
  level_ = mix(level_, becomes_level);
  sloped_ = mix(sloped_, becomes_sloped);
}

void LevelGround::learn(const Eigen::Vector3d& step_W, const SO3& R) {
  const double h = up_W_.dot(step_W);
  const Eigen::Vector3d along = step_W - h * up_W_;
  predict(along.norm());
  Vector H;
  H << R.inverse() * along, along;
  const std::array<Hypothesis*, 2> both = {&level_, &sloped_};
  double likelihood = 0, expected = 0;
  std::array<double, 2> of{};
  for (std::size_t i = 0; i < 2; ++i) {
    const double mean = H.dot(both[i]->mean), S = H.dot(both[i]->P * H) + step_variance();
    of[i] = both[i]->probability * std::exp(-0.5 * (h - mean) * (h - mean) / S) / std::sqrt(2 * M_PI * S);
    likelihood += of[i];
    expected += of[i] * mean;
  }
  if (!(likelihood >= stair_probability / stair_range)) {
    is_level_ = false;
    stair_variance_ += wrong_share * wrong_share * h * h;
    level_.probability = usually_level;
    sloped_.probability = 1 - usually_level;
    return;
  }
  noise_.add(h - expected / likelihood, 1);
  for (std::size_t i = 0; i < 2; ++i) {
    const Vector PH = both[i]->P * H;
    const double S = H.dot(PH) + step_variance();
    both[i]->mean += PH * ((h - H.dot(both[i]->mean)) / S);
    both[i]->P -= PH * PH.transpose() / S;
    both[i]->probability = std::clamp(of[i] / likelihood, least_probability, 1 - least_probability);
  }
}

void LevelGround::find_vertical(const Estimate& e) {
  if (vertical_W_) return;
  up_W_ = -e.x.g.normalized();
  const bool is_known = e.P.diagonal().segment<2>(at::g).maxCoeff() < known_vertical * known_vertical * e.x.g.squaredNorm();
  if (is_known || (is_level_ && first_ && e.t - *first_ > longest_search)) vertical_W_ = up_W_;
}

void LevelGround::stands_at(std::size_t side, const Eigen::Vector3d& pc_W) {
  if (has_come_down_ != side || !pc_W.allFinite()) return;
  last_ = pc_W;
  has_come_down_.reset();
}

// The first foothold, which is all that is known of the height, until it is another floor that turns out to be level.
void LevelGround::find_floor(const Eigen::Vector3d& p_W, const Estimate& e) {
  has_left_floor_ = has_left_floor_ || !is_level_;
  const double higher = floor_ ? up_W_.dot(p_W - *floor_) : 0;
  if (floor_ && (!is_level_ || std::abs(higher) < same_floor)) {
    has_left_floor_ = !is_level_;
    return;
  }
  floor_variance_ = up_W_.dot(e.P.block<3, 3>(at::p, at::p) * up_W_);
  // Where no slope or stair led there, it may be the same floor.
  if (!has_left_floor_) floor_variance_ += wrong_share * wrong_share * higher * higher;
  floor_ = floor_ ? last_.value_or(p_W) : p_W;
  has_left_floor_ = false;
}

std::optional<GroundPatch> LevelGround::touchdown(std::size_t side, const Eigen::Vector3d& p_W, const Estimate& e) {
  if (!p_W.allFinite() || !e.x.R.matrix().allFinite() || !(e.x.g.norm() > 0)) return std::nullopt;  // a state that is discarded
  if (++touchdowns_ == touchdowns_of_a_walk) first_ = e.t;
  if (last_) learn(p_W - *last_, e.x.R);
  find_vertical(e);
  is_level_ = level_.probability > (is_level_ ? hardly_level : surely_level);
  find_floor(p_W, e);
  last_ = p_W;
  has_come_down_ = side;
  if (!is_level_) return std::nullopt;
  // What the legs climb too much may not be taken for a tilt of the world.
  const Eigen::Vector3d d = e.x.R.inverse() * (p_W - *floor_);
  const double climb2 = vertical_W_ ? 0 : d.dot(level_.P.topLeftCorner<3, 3>() * d);
  return GroundPatch{up_W_, *floor_, std::sqrt(std::max(least_noise * least_noise, step_variance()) + climb2), !vertical_W_};
}

}  // namespace kilvo
