#pragma once
/// Random values, as they stand in files: a distribution whose parameters are numbers or names of fuzzy values. One
/// syntax for plans ([fuzzy.random] in docs/plan.md) and files of fuzzy inputs (docs/study.md).

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "product/table_reader.h"

namespace topple::product {

struct Distribution {
  const char* name;
  const char* parameters[2];  // for people
  bool has_shape;             // the second one has no unit
};

/// The distributions that there are, by name.
inline constexpr Distribution distributions[] = {
    {"normal", {"mean", "standard deviation"}, false},
    {"lognormal", {"mean", "standard deviation"}, false},
    {"gumbel", {"mean", "standard deviation"}, false},
    {"uniform", {"lower end", "upper end"}, false},
    {"weibull", {"scale", "shape"}, true},
};
/// nullptr: there is none of that name.
const Distribution* find_distribution(const std::string& name);
/// Why these parameters give no distribution: "the standard deviation is below 0"; empty: they do.
std::string find_distribution_fault(const Distribution&, double first, double second);

struct RandomParameter {
  std::string name;  // of a fuzzy value; empty: a number
  double value = 0;  // SI in plans
  Place place;
};

struct RandomValue {
  std::string name;
  const Distribution* distribution = nullptr;
  std::array<RandomParameter, 2> parameters;
  Place place;
};

/// Whether a word can name a value in formulas: a letter or _, then letters, digits and _.
bool is_plain_name(const std::string&);

/// Help for who wrote no distribution.
inline constexpr const char* random_help = "such as { normal = [\"mean_fc\", 3] }";
/// Whether the table names a distribution.
bool says_distribution(const Node&);
/// The only distribution of the table with its parameters; nothing after a complaint.
///   dimension  of the value; none: numbers without units are wanted
std::optional<RandomValue> read_distribution(TableReader&, std::optional<Dimension>);

/// The table [randomness]: how random values are sampled, and which statistics of outputs are asked for.
struct RandomSettings {
  bool is_given = false;
  int runs = 0;  // for each point of the fuzzy values, >= 2
  std::uint64_t seed = 1;
  double most_failed = 0;        // share of these runs that may fail
  std::vector<Word> statistics;  // "mean(tilt)"
  Place place;
};
RandomSettings read_random_settings(TableReader& parent);

/// Complains of parameters that give no distribution somewhere between these ends.
///   ends  of each parameter: least and largest value
void check_distribution(const RandomValue&, const std::array<std::array<double, 2>, 2>& ends, const std::string& label,
                        Complaints&);

}  // namespace topple::product
