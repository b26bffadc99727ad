#include "kilvo/filter/gain.hpp"

#include <algorithm>
#include <cmath>

namespace kilvo {
namespace {

// A column of the error state's size that stays in registers while others are added to it.
constexpr int lanes = 4, packs = at::size / lanes;
static_assert(packs * lanes == at::size - 1, "one is left over");
using Pack = double __attribute__((vector_size(lanes * sizeof(double)), aligned(sizeof(double)), may_alias));

struct Column {
  Pack pack[packs];
  double last;
};

[[gnu::always_inline]] inline void read(Column& c, const double* from) {
  for (int i = 0; i < packs; ++i) c.pack[i] = *reinterpret_cast<const Pack*>(from + lanes * i);
  c.last = from[at::size - 1];
}

[[gnu::always_inline]] inline void write(const Column& c, double* to) {
  for (int i = 0; i < packs; ++i) *reinterpret_cast<Pack*>(to + lanes * i) = c.pack[i];
  to[at::size - 1] = c.last;
}

// c += s x
[[gnu::always_inline]] inline void add(Column& c, double s, const double* x) {
  for (int i = 0; i < packs; ++i) c.pack[i] += s * *reinterpret_cast<const Pack*>(x + lanes * i);
  c.last += s * x[at::size - 1];
}

[[gnu::always_inline]] inline void scale(Column& c, double s) {
  for (int i = 0; i < packs; ++i) c.pack[i] *= s;
  c.last *= s;
}

}  // namespace

KILVO_WIDE void project_rows(const Covariance& P, const double* H, int rows, double* S, double* W) {
  double of_row[at::size][lanes * packs];  // W by rows; of the columns that a pack reads
  for (auto& row : of_row) std::fill_n(row, (rows + lanes - 1) / lanes * lanes, 0.0);
  for (int i = 0; i < rows; ++i) {
    const double* h = H + i * at::size;
    int touched[at::size], count = 0;
    Column w{};
    for (int j = 0; j < at::size; ++j) {
      if (h[j] == 0) continue;
      touched[count++] = j;
      add(w, h[j], P.data() + j * at::size);
    }
    write(w, W + i * at::size);
    for (int j = 0; j < at::size; ++j) of_row[j][i] = W[i * at::size + j];
    double s[lanes * packs] = {};
    for (int k = 0; k <= i; ++k) s[k] = S[k * rows + i];
    for (int first = 0; first <= i; first += lanes) {
      Pack sum = *reinterpret_cast<const Pack*>(s + first);
      for (int n = 0; n < count; ++n) sum += h[touched[n]] * *reinterpret_cast<const Pack*>(&of_row[touched[n]][first]);
      *reinterpret_cast<Pack*>(s + first) = sum;
    }
    for (int k = 0; k <= i; ++k) S[k * rows + i] = s[k];
  }
}

KILVO_WIDE bool detail::factor(double* S, int rows, double* W, double* inverse) {
  for (int i = 0; i < rows; ++i) {
    Column w;
    read(w, W + i * at::size);
    double square = S[i * rows + i];
    for (int k = 0; k < i; ++k) {
      double v = S[k * rows + i];
      for (int m = 0; m < k; ++m) v -= S[m * rows + i] * S[m * rows + k];
      v *= inverse[k];
      S[k * rows + i] = v;
      square -= v * v;
      add(w, -v, W + k * at::size);
    }
    if (!(square > 0)) return false;
    inverse[i] = 1 / std::sqrt(square);
    scale(w, inverse[i]);
    write(w, W + i * at::size);
  }
  return true;
}

KILVO_WIDE void detail::reduce(const Covariance& P, const double* W, int rows, Covariance& out) {
  // Whole columns: what is above the diagonal comes out as what it mirrors, to the bit.
  for (int j = 0; j < at::size; ++j) {
    Column c;
    read(c, P.data() + j * at::size);
    for (int k = 0; k < rows; ++k) add(c, -W[k * at::size + j], W + k * at::size);
    write(c, out.data() + j * at::size);
  }
}

}  // namespace kilvo
