#include "uncertainty/archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <utility>

#include "base/error.h"

namespace topple::uncertainty {
namespace {

std::size_t calc_hash(const Point& x) {
  std::uint64_t h = 0x9e3779b97f4a7c15u;
  for (const double v : x) {
    h ^= std::bit_cast<std::uint64_t>(v == 0 ? 0.0 : v);
    h *= 0xbf58476d1ce4e5b9u;
    h ^= h >> 31;
  }
  return static_cast<std::size_t>(h);
}

/// What a model must not give becomes a failed run that says why.
void settle(Result& r) {
  if (r.state != Result::State::Done) {
    r.values.clear();
    return;
  }
  const auto bad =
      std::find_if_not(r.values.begin(), r.values.end(), [](double v) { return std::abs(v) <= most_value; });
  if (bad == r.values.end()) return;
  r.state = Result::State::Failed;
  r.text = std::isfinite(*bad) ? fmt::format("a value is larger than {:.3g}", most_value)
                               : std::string("a value is not finite");
  r.values.clear();
}

}  // namespace

int Archive::find(const Point& x) const {
  const auto [first, last] = index_.equal_range(calc_hash(x));
  for (auto i = first; i != last; ++i)
    if (samples_[i->second].x == x) return i->second;
  return -1;
}

int Archive::add(Sample s) {
  if (const int there = find(s.x); there >= 0) return there;
  const int i = static_cast<int>(samples_.size());
  index_.emplace(calc_hash(s.x), i);
  failed_ += s.result.state == Result::State::Failed;
  samples_.push_back(std::move(s));
  return i;
}

Asker::Asker(Evaluate evaluate, const Progress& progress, const Archive* earlier, int limit)
    : evaluate_(std::move(evaluate)), progress_(&progress), earlier_(earlier), limit_(limit), told_limit_(limit) {}

std::vector<int> Asker::ask(const std::vector<Point>& points) {
  std::vector<int> indices(points.size(), -1);
  if (is_cancelled()) {
    cancelled_ = true;
    return indices;
  }
  // the new points in order, each once, up to the limit
  Archive wanted;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (indices[i] = archive_.find(points[i]); indices[i] < 0 && static_cast<int>(wanted.size()) < rest())
      wanted.add({points[i], {}});
  std::vector<Result> results(wanted.size());
  std::vector<Point> batch;
  std::vector<std::size_t> place;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const Point& x = wanted[static_cast<int>(k)].x;
    if (const int known = earlier_ ? earlier_->find(x) : -1; known >= 0) {
      results[k] = (*earlier_)[known].result;
    } else {
      batch.push_back(x);
      place.push_back(k);
    }
  }
  if (!batch.empty()) {
    std::vector<Result> out(batch.size());
    evaluate_(batch, out);
    ++batches_;
    for (std::size_t k = 0; k < batch.size(); ++k) {
      run_ += out[k].state != Result::State::NotRun;
      results[place[k]] = std::move(out[k]);
    }
  }
  // kept in the order asked for, whatever came from where
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    settle(results[k]);
    if (results[k].state == Result::State::NotRun) {
      cancelled_ = true;
      continue;
    }
    if (results[k].state == Result::State::Done) {
      const int count = static_cast<int>(results[k].values.size());
      if (outputs_ == 0) outputs_ = count;
      if (count != outputs_)
        throw InputError("E803",
                         fmt::format("the mapping gave {} values at one point and {} at another", outputs_, count));
    }
    archive_.add({wanted[static_cast<int>(k)].x, std::move(results[k])});
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    if (indices[i] < 0) indices[i] = archive_.find(points[i]);
  if (progress_->report) progress_->report(asked(), told_limit_);
  return indices;
}

}  // namespace topple::uncertainty
