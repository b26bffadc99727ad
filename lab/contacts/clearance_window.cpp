#include "lab/contacts/clearance_window.hpp"

#include <algorithm>

namespace kilvo::lab {
namespace {

// Stamps of 1 kHz vary: what is nearly a millisecond apart is kept.
constexpr Duration spacing = std::chrono::microseconds(900);

}  // namespace

void ClearanceWindow::add(Time t, double c) {
  if (count_ > 0 && t - before(0).t < spacing) return;
  entries_[count_++ % capacity] = {t, c};
}

std::size_t ClearanceWindow::within(Duration slice) const {
  const std::size_t kept = std::min(count_, capacity);
  std::size_t n = 0;
  while (n < kept && before(0).t - before(n).t <= slice) ++n;
  return n;
}

std::optional<double> ClearanceWindow::area(Duration slice) const {
  const std::size_t n = within(slice);
  if (n < 3) return std::nullopt;
  const Entry &first = before(n - 1), &last = before(0);
  double sum = 0;
  for (std::size_t k = n - 1; k > 0; --k) {
    sum += 0.5 * (before(k).c + before(k - 1).c) * to_seconds(before(k - 1).t - before(k).t);
  }
  return sum - 0.5 * (first.c + last.c) * to_seconds(last.t - first.t);
}

std::optional<double> ClearanceWindow::trend(Duration slice) const {
  const std::size_t n = within(slice);
  if (n < 3) return std::nullopt;
  double mean_t = 0, mean_c = 0, tt = 0, tc = 0;
  for (std::size_t k = 0; k < n; ++k) {
    mean_t += to_seconds(before(k).t - before(0).t) / static_cast<double>(n);
    mean_c += before(k).c / static_cast<double>(n);
  }
  for (std::size_t k = 0; k < n; ++k) {
    const double t = to_seconds(before(k).t - before(0).t) - mean_t;
    tt += t * t;
    tc += t * (before(k).c - mean_c);
  }
  return tc / tt;
}

}  // namespace kilvo::lab
