// Compiled once for each instruction set (Highway's foreach_target).
#include "nearfield/section_kernel.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nearfield/section_kernel.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#ifndef TOPPLE_NEARFIELD_SECTION_FIELDS
#define TOPPLE_NEARFIELD_SECTION_FIELDS
namespace topple::nearfield::kernel {
inline constexpr size_t kRow = 8;
/// Fields of a row of steel.
enum SteelField : size_t {
  kAt,
  kArea,
  kEs,
  kFy,
  kFu,
  kEpsY,
  kEpsU,
  kHardening,
  kHardeningShare,
  kBuckling,
  kEpsStar,
  kStressStar,
  kSlopeStar,
  kEpsResidual,
  kResidual,
  kPlastic,
  kBack,
  kSteelFields
};
}  // namespace topple::nearfield::kernel
#endif

HWY_BEFORE_NAMESPACE();
namespace topple::nearfield::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
struct Stress {
  hn::Vec<D> stress, tangent;
};

/// e^y for -8 < y <= 0, to 2 units of the last place: y = k ln 2 + r, Taylor's series in r, then k into the exponent.
template <class D>
HWY_INLINE hn::Vec<D> exp_negative(D d, hn::Vec<D> y) {
  const auto num = [&](double v) { return hn::Set(d, v); };
  // Adding 1.5 · 2^52 rounds to a whole number, which then stands in the low bits.
  const auto magic = num(6755399441055744.0);
  const auto shifted = hn::Add(hn::Mul(y, num(1.4426950408889634)), magic);
  const auto k = hn::Sub(shifted, magic);
  const auto r =
      hn::Sub(hn::Sub(y, hn::Mul(k, num(0.693147180369123816490))), hn::Mul(k, num(1.90821492927058770002e-10)));
  const auto r2 = hn::Mul(r, r), r4 = hn::Mul(r2, r2), r8 = hn::Mul(r4, r4);
  const auto pair = [&](double a, double b) { return hn::Add(num(a), hn::Mul(num(b), r)); };
  const auto p01 = pair(1, 1), p23 = pair(1.0 / 2, 1.0 / 6), p45 = pair(1.0 / 24, 1.0 / 120),
             p67 = pair(1.0 / 720, 1.0 / 5040), p89 = pair(1.0 / 40320, 1.0 / 362880),
             pab = pair(1.0 / 3628800, 1.0 / 39916800);
  const auto pcd = pair(1.0 / 479001600, 1.0 / 6227020800.0);
  const auto low = hn::Add(hn::Add(p01, hn::Mul(p23, r2)), hn::Mul(hn::Add(p45, hn::Mul(p67, r2)), r4));
  const auto high = hn::Add(hn::Add(p89, hn::Mul(pab, r2)), hn::Mul(pcd, r4));
  const auto series = hn::Add(low, hn::Mul(high, r8));
  // 2^k: the low bits of `shifted` are k in two's complement.
  const hn::RebindToSigned<D> di;
  const auto exponent = hn::ShiftLeft<52>(hn::BitCast(di, shifted));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, series), exponent));
}

/// material::calc_envelope for the strains of a vector.
template <class D>
HWY_INLINE Stress<D> calc_concrete(D d, const material::Concrete& c, hn::Vec<D> eps) {
  const auto num = [&](double v) { return hn::Set(d, v); };
  const auto zero = hn::Zero(d);
  const auto pulled = hn::Gt(eps, num(c.eps_ct));
  // Linear on both sides: from the end of the elastic branch in compression to the cracking strain.
  Stress<D> out{hn::Mul(num(c.Ec), eps), num(c.Ec)};
  const auto e = hn::Neg(eps);
  const auto bent = hn::Gt(e, num(c.eps_linear));
  if (!hn::AllFalse(d, bent)) {
    const auto soft = hn::Gt(e, num(c.eps_c1));
    const auto r = hn::Mul(e, num(1 / c.eps_c1)), x = hn::Sub(e, num(c.eps_c1));
    const auto k2 = num(c.k - 2), tail_x = hn::Mul(num(c.tail), x);
    const auto under =
        hn::IfThenElse(soft, hn::Add(num(c.inverse_fc), hn::Mul(tail_x, x)), hn::Add(num(1), hn::Mul(k2, r)));
    const auto inverse = hn::Div(num(1), under);
    const auto s = hn::Mul(hn::Mul(hn::Sub(num(c.k), r), r), inverse);
    const auto rise =
        hn::Mul(hn::Mul(num(c.fc / c.eps_c1), hn::Sub(hn::Sub(num(c.k), hn::Add(r, r)), hn::Mul(s, k2))), inverse);
    const auto fall = hn::Mul(hn::Mul(num(-2), tail_x), hn::Mul(inverse, inverse));
    const auto stress = hn::IfThenElse(soft, inverse, hn::Mul(num(c.fc), s));
    out.stress = hn::IfThenElse(bent, hn::Neg(stress), out.stress);
    out.tangent = hn::IfThenElse(bent, hn::IfThenElse(soft, fall, rise), out.tangent);
  }
  if (!hn::AllFalse(d, pulled)) {
    const auto x = hn::Mul(hn::Sub(eps, num(c.eps_ct)), num(1 / c.eps_tu));
    const auto open = hn::Ge(x, num(1));
    auto stress = zero, tangent = zero;
    if (!hn::AllTrue(d, hn::Or(open, hn::Not(pulled)))) {
      const auto within = hn::Min(hn::Max(x, zero), num(1));
      const auto w2 = hn::Mul(within, within);
      const auto power = hn::Add(num(1), hn::Mul(hn::Mul(num(27), w2), within));
      const auto fading = exp_negative(d, hn::Mul(num(-6.93), within));
      const double end = 28 * 9.7800e-4;
      stress = hn::Mul(num(c.fct), hn::Max(zero, hn::Sub(hn::Mul(power, fading), hn::Mul(within, num(end)))));
      tangent = hn::Mul(num(c.fct / c.eps_tu),
                        hn::Sub(hn::Mul(hn::Sub(hn::Mul(num(81), w2), hn::Mul(num(6.93), power)), fading), num(end)));
    }
    out.stress = hn::IfThenElse(pulled, hn::IfThenElse(open, zero, stress), out.stress);
    out.tangent = hn::IfThenElse(pulled, hn::IfThenElse(open, zero, tangent), out.tangent);
  }
  return out;
}

/// material::calc_response of a row of bars.
template <class D>
HWY_INLINE Stress<D> calc_steel(D d, const double* row, hn::Vec<D> eps) {
  const auto field = [&](SteelField f) { return hn::LoadU(d, row + f * kRow); };
  const auto zero = hn::Zero(d);
  const auto Es = field(kEs), fy = field(kFy), hardening = field(kHardening), back = field(kBack);
  auto stress = hn::Mul(Es, hn::Sub(eps, field(kPlastic))), tangent = Es;
  const auto trial = hn::Sub(stress, back), excess = hn::Sub(hn::Abs(trial), fy);
  const auto flows = hn::Gt(excess, zero);
  const auto bound = hn::Add(fy, hn::Mul(field(kHardeningShare), excess));
  stress = hn::IfThenElse(flows, hn::Add(back, hn::CopySign(bound, trial)), stress);
  tangent = hn::IfThenElse(flows, hardening, tangent);
  // compression: the strength, Euler and Johnson, Dhakal & Maekawa
  const auto e = hn::Neg(eps), star = field(kEpsStar), eps_y = field(kEpsY);
  auto limit = hn::Min(field(kFu), field(kBuckling)), slope = zero;
  const auto before = hn::Le(e, star), falls = hn::Lt(e, field(kEpsResidual));
  const auto fall_slope = hn::Mul(hn::Set(d, -0.02), Es);
  const auto down = hn::IfThenElse(
      before, hn::Add(fy, hn::Mul(field(kSlopeStar), hn::Sub(e, eps_y))),
      hn::IfThenElse(falls, hn::Add(field(kStressStar), hn::Mul(fall_slope, hn::Sub(e, star))), field(kResidual)));
  const auto down_slope = hn::IfThenElse(before, field(kSlopeStar), hn::IfThenElse(falls, fall_slope, zero));
  const auto steeper = hn::And(hn::Gt(e, eps_y), hn::Lt(down, limit));
  limit = hn::IfThenElse(steeper, down, limit), slope = hn::IfThenElse(steeper, down_slope, slope);
  const auto caps = hn::Gt(hn::Neg(stress), hn::Max(limit, zero));
  stress = hn::IfThenElse(caps, hn::Neg(limit), stress), tangent = hn::IfThenElse(caps, slope, tangent);
  const auto broken = hn::Gt(eps, field(kEpsU));
  return {hn::IfThenElse(broken, zero, stress), hn::IfThenElse(broken, zero, tangent)};
}

/// Sums over the eight places of a row, held in as many vectors as that takes.
template <class D>
struct Sums {
  static constexpr size_t kParts = kRow / hn::MaxLanes(D());
  hn::Vec<D> N[kParts], M[kParts], dN[kParts], dM[kParts], dMk[kParts];
};

template <class D>
HWY_INLINE void add(D d, Sums<D>& sums, size_t part, hn::Vec<D> at, hn::Vec<D> area, const Stress<D>& a) {
  (void)d;
  const auto force = hn::Mul(area, a.stress), stiffness = hn::Mul(area, a.tangent), lever = hn::Mul(stiffness, at);
  sums.N[part] = hn::Add(sums.N[part], force);
  sums.M[part] = hn::Add(sums.M[part], hn::Mul(force, at));
  sums.dN[part] = hn::Add(sums.dN[part], stiffness);
  sums.dM[part] = hn::Add(sums.dM[part], lever);
  sums.dMk[part] = hn::Add(sums.dMk[part], hn::Mul(lever, at));
}

template <class D>
HWY_INLINE double total(D d, const hn::Vec<D>* parts) {
  double v[kRow];
  for (size_t p = 0; p < Sums<D>::kParts; ++p) hn::StoreU(parts[p], d, v + p * hn::MaxLanes(d));
  return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
}

template <class D>
HWY_INLINE Resultants calc(const PackedSection& s, double eps_0, double kappa) {
  const D d;
  constexpr size_t width = hn::MaxLanes(D()), parts = Sums<D>::kParts;
  Sums<D> sums;
  for (size_t p = 0; p < parts; ++p) sums.N[p] = sums.M[p] = sums.dN[p] = sums.dM[p] = sums.dMk[p] = hn::Zero(d);
  const auto e0 = hn::Set(d, eps_0), k = hn::Set(d, kappa);
  const double* row = s.data.data();
  for (size_t i = 0; i < s.core_rows + s.cover_rows; ++i, row += 2 * kRow) {
    const material::Concrete& c = i < s.core_rows ? s.core : s.cover;
    for (size_t p = 0; p < parts; ++p) {
      const auto at = hn::LoadU(d, row + p * width), area = hn::LoadU(d, row + kRow + p * width);
      add(d, sums, p, at, area, calc_concrete(d, c, hn::Add(e0, hn::Mul(k, at))));
    }
  }
  for (size_t i = 0; i < s.steel_rows; ++i, row += kSteelFields * kRow)
    for (size_t p = 0; p < parts; ++p) {
      const auto at = hn::LoadU(d, row + p * width), area = hn::LoadU(d, row + kRow + p * width);
      add(d, sums, p, at, area, calc_steel(d, row + p * width, hn::Add(e0, hn::Mul(k, at))));
    }
  return {total(d, sums.N), total(d, sums.M), total(d, sums.dN), total(d, sums.dM), total(d, sums.dMk)};
}

using Wide = hn::CappedTag<double, kRow>;
using One = hn::CappedTag<double, 1>;

Resultants calc_here(const PackedSection& s, double eps_0, double kappa) { return calc<Wide>(s, eps_0, kappa); }
Resultants calc_singly_here(const PackedSection& s, double eps_0, double kappa) { return calc<One>(s, eps_0, kappa); }
const char* name_here() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::nearfield::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::nearfield {

namespace kernel {
HWY_EXPORT(calc_here);
HWY_EXPORT(calc_singly_here);
HWY_EXPORT(name_here);
}  // namespace kernel

namespace {

/// Writes places and areas as rows of eight; returns the number of rows.
size_t add_rows(const std::vector<double>& at, const std::vector<double>& area, std::vector<double>& out) {
  constexpr size_t n = kernel::kRow;
  const size_t rows = (at.size() + n - 1) / n;
  for (size_t r = 0; r < rows; ++r) {
    const size_t begin = out.size();
    out.resize(begin + 2 * n, 0.0);
    for (size_t i = r * n; i < std::min(at.size(), (r + 1) * n); ++i)
      out[begin + i - r * n] = at[i], out[begin + n + i - r * n] = area[i];
  }
  return rows;
}

}  // namespace

PackedSection pack_section(const Fibres& f) {
  using namespace kernel;
  PackedSection out;
  out.core = f.core, out.cover = f.cover;
  std::vector<double> core_at, core_area, cover_at, cover_area;
  for (size_t i = 0; i < f.at.size(); ++i) {
    if (f.core_area[i] > 0) core_at.push_back(f.at[i]), core_area.push_back(f.core_area[i]);
    if (f.cover_area[i] > 0) cover_at.push_back(f.at[i]), cover_area.push_back(f.cover_area[i]);
  }
  // The bars stand where the layers have counted concrete.
  if (has_concrete(f))
    for (size_t i = 0; i < f.bar_at.size(); ++i)
      core_at.push_back(f.bar_at[i]), core_area.push_back(-f.kept * f.bar_area[i]);
  out.core_rows = add_rows(core_at, core_area, out.data);
  out.cover_rows = add_rows(cover_at, cover_area, out.data);
  out.steel_rows = (f.bar_at.size() + kRow - 1) / kRow;
  for (size_t r = 0; r < out.steel_rows; ++r) {
    const size_t begin = out.data.size();
    out.data.resize(begin + kSteelFields * kRow, 0.0);
    for (size_t l = 0; l < kRow; ++l) {
      // padding repeats the last bar, without area
      const size_t i = std::min(r * kRow + l, f.bar_at.size() - 1);
      const material::Steel& s = f.bar_law[i];
      const double field[kSteelFields] = {f.bar_at[i],
                                          r * kRow + l < f.bar_at.size() ? f.bar_area[i] : 0,
                                          s.Es,
                                          s.fy,
                                          s.fu,
                                          s.eps_y,
                                          s.eps_u,
                                          s.hardening,
                                          s.hardening / s.Es,
                                          s.buckling_stress,
                                          s.eps_star,
                                          s.stress_star,
                                          s.slope_star,
                                          s.eps_residual,
                                          s.residual,
                                          0,
                                          0};
      for (size_t k = 0; k < kSteelFields; ++k) out.data[begin + k * kRow + l] = field[k];
    }
  }
  return out;
}

void set_bars(PackedSection& s, const material::SteelState* bars, size_t count) {
  using namespace kernel;
  double* rows = s.data.data() + (s.core_rows + s.cover_rows) * 2 * kRow;
  for (size_t i = 0; i < count; ++i) {
    double* field = rows + i / kRow * kSteelFields * kRow + i % kRow;
    field[kPlastic * kRow] = bars[i].plastic, field[kBack * kRow] = bars[i].back;
    if (bars[i].ruptured) field[kArea * kRow] = 0;
  }
}

Resultants calc_resultants(const PackedSection& s, double eps_0, double kappa) {
  using namespace kernel;
  return HWY_DYNAMIC_DISPATCH(calc_here)(s, eps_0, kappa);
}
Resultants calc_resultants_singly(const PackedSection& s, double eps_0, double kappa) {
  using namespace kernel;
  return HWY_DYNAMIC_DISPATCH(calc_singly_here)(s, eps_0, kappa);
}
std::string section_kernel_target() {
  using namespace kernel;
  return HWY_DYNAMIC_DISPATCH(name_here)();
}

}  // namespace topple::nearfield
#endif
