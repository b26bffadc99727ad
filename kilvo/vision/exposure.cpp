// What the exposure of an image is, before anything else is asked of it.
#include <cmath>

#include "kilvo/vision/photometric.hpp"

namespace kilvo {

// What was seen first has passed through the fewest estimates of the exposure.
std::pair<Values, double> PhotometricModel::as_first_seen(std::size_t i, const SE3& T_CW) const {
  const Prepared& p = prepared_[i];
  const VisualPoint& point = map_.point(tracks_[i].point);
  if (tracks_[i].observation != point.observations[0]) {
    const Observation& first = map_.observation(point.observations[0]);
    const VisualFrame& frame = map_.frame(first.frame);
    const auto plane = warp_between(camera_, T_CW, frame.T_CW, point.p_W, point.normal_W.cast<double>());
    if (const auto old = plane ? warp(first, *plane, level_) : std::nullopt) return {old->value, frame.tau};
  }
  return {p.patch->value, p.tau};
}

std::optional<Brightness> PhotometricModel::exposure_at(const State& x) const {
  struct Compared {
    double log;
    float top;   // of the patch
    double tau;  // of the patch
    bool is_plain;
  };
  std::vector<Compared> compared;
  const SE3 T_CW = at_.T_CI * x.pose().inverse();
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Prepared& p = prepared_[i];
    const auto view = begins_at(x) ? p.first_view : view_of(camera_, at_.T_CI, x.pose(), p.p_W);
    if (!p.patch || !view || !camera_.sees(view->pixel, border_at(level_ + 1))) continue;
    Values seen;
    sample_patch(pyramid_[static_cast<std::size_t>(level_)], at_level(view->pixel, level_).cast<float>(), seen);
    const auto [patch, tau] = as_first_seen(i, T_CW);
    const float here = mean_of(seen), there = mean_of(patch);
    constexpr float dark = 8;
    if (here < dark || there < dark || here > overexposed || there > overexposed) continue;
    compared.push_back({std::log(tau * static_cast<double>(there / here)), top_of(patch), tau, p.plain});
  }
  // A plain surface is known to be the same only by where it is, and of one that is too bright in part the rest is what is dark.
  const auto of = [&](auto&& is_wanted) {
    std::vector<double> logs;
    for (const Compared& c : compared) {
      if (is_wanted(c)) logs.push_back(c.log);
    }
    return logs.size() < enough_corners ? std::nullopt : std::optional(brightness_of(std::move(logs)));
  };
  const auto all = of([](const Compared&) { return true; });
  if (!all) return std::nullopt;
  Brightness best = *all;
  // Which are too bright depends on the exposure that is looked for.
  for (int k = 0; k < 3; ++k) {
    const auto better = of(
        [&](const Compared& c) { return !c.is_plain && !is_saturated(c.top, static_cast<double>(c.top) * c.tau * std::exp(-best.log)); });
    if (!better) break;
    best = *better;
  }
  return best;
}

}  // namespace kilvo
