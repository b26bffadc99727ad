#include "lab/simulation/walk.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <numbers>

namespace kilvo::lab {
namespace {

using std::numbers::pi;
constexpr double spacing = 0.1;  // s, of the control points of the pelvis
namespace channel {
enum : std::uint8_t { x, y, z, yaw, phase, sway, bob, roll, pitch, twist, lean };
}

// An impact rings at this frequency and dies away at this rate. It sets in like an error function, `onset` wide: that leaves next to
// nothing above 100 Hz, so that 200 samples a second are enough to integrate it.
constexpr double ring_frequency = 2 * pi * 28, ring_decay = 25, ring_onset = 0.005, ring_delay = 0.027;
constexpr double ring_length = 1.2;  // s; less than a picometre is left then

// Displacement per unit of acceleration, m per m/s^2.
double ring(double t) {
  if (t <= 0 || t > ring_length) return 0;
  const double since = t - ring_delay, grown = std::erfc(-since / (ring_onset * std::numbers::sqrt2)) / 2;
  return grown * std::exp(-ring_decay * since) * std::sin(ring_frequency * since) / (ring_frequency * ring_frequency);
}

// Turns the foot by `angle` about its y axis through a point of its sole.
SE3 pivot(double x, double z, double angle) {
  const Eigen::Vector3d edge(x, 0, z);
  const SO3 R = SO3::Exp({0, angle, 0});
  return {R, edge - R * edge};
}

// How far a foot comes in t seconds that gets under way at one metre a second.
double under_way(double t) {
  constexpr double takes = 0.01;  // s
  const double x = std::min(t / takes, 1.0);
  return takes * x * x * x * (1 - x / 2) + std::max(t - takes, 0.0);
}

// From where the foot left to where it comes down; u from 0 to 1. Up first, then across; down last. Up at once, as a sole is pulled off by
// a heel that has been rising, and not down to rest: the ground stops it.
SE3 swing(const SE3& from, const Footprint& next, double lasts, double u) {
  const SE3& to = next.sole;
  const double rise = to.p.z() - from.p.z();
  constexpr double step_edge = 0.02;  // m
  const double across = smooth_step((u - (rise > step_edge ? 0.16 : 0.05)) / (std::abs(rise) > step_edge ? 0.79 : 0.9));
  const double up = rise > step_edge ? smooth_step(u / 0.5) : rise < -step_edge ? smooth_step((u - 0.5) / 0.5) : smooth_step(u);
  SE3 out{from.R * SO3::Exp(across * (from.R.inverse() * to.R).Log()), from.p + across * (to.p - from.p)};
  out.p.z() = from.p.z() + up * rise + next.swing_lift * smooth_bump(u);
  const double back = 1 - u;
  out.p.z() += back * (under_way(lasts * u) * next.swing_leaving * back * back + lasts * u * u * u * next.swing_landing);
  return out;
}

}  // namespace

Walk::Walk(const BipedShape& shape, const Ground& ground, const Place& start, const std::vector<Stage>& stages)
    : shape_(shape), T_torso_imu_(shape.T_torso_imu()), plan_(plan_footsteps(shape, ground, start, stages)), base_(spacing) {
  const int controls = static_cast<int>(std::ceil(plan_.end / spacing)) + 10;
  for (int i = 0; i < controls; ++i) base_.add(raw_base(i * spacing));
  add_impacts();
  check(ground);
}

// Where the pelvis should be at t, with corners in it: halfway between the feet, ahead as the steps go on.
Walk::Base::Point Walk::raw_base(double t) const {
  const auto next = std::upper_bound(plan_.steps.begin(), plan_.steps.end(), t, [](double v, const Step& s) { return v < s.begin; });
  const auto begun = next - plan_.steps.begin();
  const Step* step = begun > 0 ? &plan_.steps[static_cast<std::size_t>(begun - 1)] : nullptr;
  const double done = step != nullptr ? std::min((t - step->begin) / step->period, 1.0) : 1.0;
  const double phase = static_cast<double>(begun) - 1 + done;
  const double place = std::clamp(phase - 0.5, 0.0, static_cast<double>(plan_.frames.size() - 1));
  const auto k = std::min(static_cast<std::size_t>(place), plan_.frames.size() - 1);
  const double f = place - static_cast<double>(k);
  const Eigen::Vector4d frame = (1 - f) * plan_.frames[k] + f * plan_.frames[std::min(k + 1, plan_.frames.size() - 1)];

  const bool walking = step != nullptr && done < 1;
  const Gait gait = walking ? step->gait : Gait{};
  const double on = walking ? 1 : 0;
  Base::Point out;
  out << frame.x(), frame.y(), frame.z() + shape_.sole_depth + gait.hip_height - shape_.hip.z(), frame.w(), phase, on * gait.sway,
      on * gait.bob, on * gait.roll, on * gait.pitch, on * gait.twist, on * gait.lean;
  return out;
}

void Walk::add_impacts() {
  for (const Step& step : plan_.steps) {
    if (step.gait.impact > 0) impacts_.push_back({step.begin + step.period - step.gait.double_support / 2, step.gait.impact});
  }
  std::ranges::sort(impacts_, {}, &Impact::t);
}

// Displacement up (m) and pitch (rad) of the ringing.
Eigen::Vector2d Walk::ringing(double t) const {
  double sum = 0;
  auto it = std::ranges::upper_bound(impacts_, t, {}, &Impact::t);
  while (it != impacts_.begin() && t - std::prev(it)->t < ring_length) {
    --it;
    sum += it->strength * ring(t - it->t);
  }
  constexpr double pitch_per_metre = 1.0;
  return {sum, pitch_per_metre * sum};
}

SE3 Walk::pelvis(double t) const {
  const Base::Point b = base_.at(t);
  const double phase = pi * b[channel::phase], yaw = b[channel::yaw];
  const double side = std::sin(phase), both = std::cos(2 * phase);
  const Eigen::Vector2d ring_now = ringing(t);
  // The pelvis leans over the standing foot: the right one in the even steps.
  const Eigen::Vector3d aside = -b[channel::sway] * side * Eigen::Vector3d(-std::sin(yaw), std::cos(yaw), 0);
  const Eigen::Vector3d ahead = 0.3 * ring_now.x() * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
  SE3 out;
  out.p = Eigen::Vector3d(b[channel::x], b[channel::y], b[channel::z] - b[channel::bob] * both + ring_now.x()) + aside + ahead;
  out.R = SO3::Exp({0, 0, yaw + b[channel::twist] * std::cos(phase)}) *
          SO3::Exp({0, b[channel::lean] + b[channel::pitch] * std::sin(2 * phase) + ring_now.y(), 0}) *
          SO3::Exp({-b[channel::roll] * side, 0, 0});
  return out;
}

SE3 Walk::pelvis_torso(double t) const {
  const Base::Point b = base_.at(t);
  // The waist turns the torso against the pelvis, so that it yaws less than the hips do, and the other way round.
  return {SO3::Exp({0, 0, -1.4 * b[channel::twist] * std::cos(pi * b[channel::phase])}), shape_.waist};
}

std::size_t Walk::print_at(Side side, double t) const {
  const auto& prints = plan_.prints[index_of(side)];
  const auto next = std::ranges::upper_bound(prints, t, {}, &Footprint::touch);
  return static_cast<std::size_t>(next - prints.begin()) - 1;
}

bool Walk::in_contact(Side side, double t) const { return t <= plan_.prints[index_of(side)][print_at(side, t)].lift; }

SE3 Walk::foot(Side side, double t) const {
  const auto& prints = plan_.prints[index_of(side)];
  const std::size_t i = print_at(side, t);
  const Footprint& print = prints[i];
  SE3 sole = print.sole;
  sole.p += print.displacement(std::min(t, print.lift) - print.touch);
  const SE3 ankle{SO3(), {0, 0, shape_.sole_depth}};
  SE3 tilt;
  // The sole rolls over its toe before it leaves, and comes down on its heel: each over this time on the ground.
  constexpr double roll_time = 0.12;
  if (i + 1 < prints.size()) {
    const Footprint& next = prints[i + 1];
    const double middle = (print.lift + next.touch) / 2;
    const double lasts = next.touch - print.lift;
    if (t > print.lift) sole = swing(sole, next, lasts, (t - print.lift) / lasts);
    const double toe = (t - print.lift + roll_time) / (middle - print.lift + roll_time);
    const double heel = (t - middle) / (next.touch + roll_time - middle);
    tilt = pivot(shape_.toe, 0, print.toe_angle * smooth_bump(toe)) * pivot(shape_.heel, 0, -next.heel_angle * smooth_bump(heel));
  }
  if (t < print.touch + roll_time && i > 0) {
    const double middle = (prints[i - 1].lift + print.touch) / 2;
    const double heel = (t - middle) / (print.touch + roll_time - middle);
    tilt = tilt * pivot(shape_.heel, 0, -print.heel_angle * smooth_bump(heel));
  }
  return sole * tilt * ankle;
}

Eigen::Vector3d Walk::velocity(double t) const {
  return first_derivative([this](double x) { return imu(x).p; }, t);
}

Eigen::Vector3d Walk::acceleration(double t) const {
  return second_derivative([this](double x) { return imu(x).p; }, t);
}

Eigen::Vector3d Walk::angular_rate(double t) const {
  const SO3 back = imu(t).R.inverse();
  return first_derivative([&](double x) { return (back * imu(x).R).Log(); }, t);
}

LegSolution Walk::leg(Side side, double t) const { return solve_leg(shape_, side, pelvis(t).inverse() * foot(side, t)); }

JointAngles Walk::joints(double t) const {
  JointAngles out{};
  for (const Side side : {Side::left, Side::right}) {
    const LegAngles angles = leg(side, t).angles;
    std::ranges::copy(angles, out.begin() + static_cast<std::ptrdiff_t>(index_of(side)) * leg_joint_count);
  }
  out.back() = pelvis_torso(t).R.Log().z();
  return out;
}

JointAngles Walk::joint_velocities(double t) const {
  constexpr double h = 2e-4;
  const JointAngles before = joints(t - h), after = joints(t + h);
  JointAngles out{};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = (after[i] - before[i]) / (2 * h);
  return out;
}

void Walk::check(const Ground& ground) const {
  constexpr double every = 0.005;
  for (double t = 0; t < plan_.end + 1; t += every) {
    for (const Side side : {Side::left, Side::right}) check_at(ground, side, t);
  }
}

void Walk::check_at(const Ground& ground, Side side, double t) const {
  const std::string fault = leg(side, t).fault;
  if (!fault.empty()) throw PlanError(fmt::format("the walk cannot be done: at {:.2f} s {}", t, fault));
  if (in_contact(side, t)) return;
  const SE3 T = foot(side, t);
  const auto& prints = plan_.prints[index_of(side)];
  const std::size_t i = print_at(side, t);
  const double below = prints[i].sink + 1e-3;  // a foot leaves from where it has sunk to
  for (const Eigen::Vector3d& corner : shape_.sole()) {
    const Eigen::Vector3d p = T * corner;
    const double clearance = p.z() - ground.height(p.x(), p.y());
    if (clearance < -below) {
      throw PlanError(fmt::format("the walk cannot be done: at {:.2f} s the {} foot would hit the ground, {:.0f} mm deep", t,
                                  side == Side::left ? "left" : "right", -1e3 * clearance));
    }
  }
}

}  // namespace kilvo::lab
