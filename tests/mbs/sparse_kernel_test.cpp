#include "mbs/sparse_kernel.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <random>
#include <string>
#include <vector>

namespace topple::mbs::kernel {
namespace {

/// For each instruction set of this machine.
template <class Function>
void on_each_target(Function f) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    f();
  }
  hwy::SetSupportedTargetsForTest(0);
}

std::vector<double> make_numbers(size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<double> x(count);
  for (double& v : x) v = number(random);
  return x;
}

TEST(SparseKernel, MultipliesBlocksInTheOrderOfColumns) {
  std::mt19937 random(5);
  const std::vector<std::uint32_t> first{0, 3, 3, 5, 6};
  const std::vector<int> row{0, 2, 3, 1, 2, 3};
  for (const size_t each : {size_t{3}, size_t{6}}) {
    const std::vector<double> value = make_numbers(each * each * row.size(), random),
                              x = make_numbers(4 * each, random), begun = make_numbers(4 * each, random);
    std::vector<double> expected = begun;
    size_t at = 0;
    for (size_t body = 0; body + 1 < first.size(); ++body)
      for (size_t n = 0; n < each; ++n)
        for (size_t i = first[body]; i < first[body + 1]; ++i)
          for (size_t m = 0; m < each; ++m)
            expected[each * static_cast<size_t>(row[i]) + m] += value[at++] * x[each * body + n];
    on_each_target([&] {
      std::vector<double> y = begun;
      add_product({each, 4, first.data(), row.data(), value.data(), x.data(), y.data()});
      EXPECT_EQ(y, expected) << each;
    });
  }
}

TEST(SparseKernel, AddsOuterProductsOneAfterTheOther) {
  std::mt19937 random(6);
  for (size_t count = 0; count <= kMostOuterProducts; ++count) {
    const std::vector<double> x = make_numbers(12 * count, random), k = make_numbers(count, random),
                              begun = make_numbers(144, random);
    std::vector<double> expected = begun;
    for (size_t r = 0; r < count; ++r)
      for (size_t i = 0; i < 12; ++i)
        for (size_t j = 0; j < 12; ++j) expected[12 * j + i] += (k[r] * x[12 * r + i]) * x[12 * r + j];
    on_each_target([&] {
      std::vector<double> sum = begun;
      add_outer_products(x.data(), k.data(), count, sum.data());
      EXPECT_EQ(sum, expected) << count;
    });
  }
}

}  // namespace
}  // namespace topple::mbs::kernel
