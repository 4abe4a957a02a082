#pragma once
/// The steps of reading a plan. Each one fills its part of the plan and complains about what is wrong with it;
/// values that could not be read are NaN or -1, which no later check complains about again.

#include <map>
#include <string>
#include <vector>

#include "product/plan.h"
#include "product/table_reader.h"

namespace topple::product {

inline constexpr int most_storeys = 1000;
inline constexpr int most_members = 20000;

/// "A*-0" in the manner of file names: * any characters, ? one character.
bool matches(const std::string& pattern, const std::string& name);

struct Reading {
  Plan& plan;
  Complaints& complaints;
  std::map<std::string, int> concretes, steels, sections, slabs, walls;  // names to indices
  bool has_grid = false;                                                 // rows, frames and storeys could be read
  bool knows_members = true;  // every rule says clearly where its members stand
  std::vector<bool> section_is_used, panel_is_used;
  std::vector<Place> section_places, panel_places;
  std::vector<Place> shaft_places;  // of the shafts' positions
  Place load_place;                 // of the storeys' loads
};

/// The bytes of a file of at most 8 MB; `what` it should be stands in the complaints. Throws InputError E106, E107.
std::string read_input(const std::string& path, const std::string& what);

void read_materials(Reading&, TableReader& root);
void read_sections(Reading&, TableReader& root);
void read_panels(Reading&, TableReader& root);
void read_site(Reading&, TableReader& root);
void read_grid(Reading&, TableReader& root);
/// Warns of neighbours that stand where the building stands.
void check_neighbours(Reading&);
/// Shafts, which stand off the grid: behind the other members.
void read_shafts(Reading&, TableReader& root);
/// Complains of shafts that stand where other members stand; what is removed stands no more.
void check_shafts(Reading&);
/// Columns, beams, slabs, walls, overrides; checks that nothing hangs in the air.
void read_members(Reading&, TableReader& root);
void read_preparation(Reading&, TableReader& root);
void read_stages(Reading&, TableReader& root);
void read_cables(Reading&, TableReader& root);
void read_criteria(Reading&, TableReader& root);
void read_analysis(Reading&, TableReader& root);
/// [fuzzy], whose paths lead to the quantities that were asked for before. `is_whole`: all of them could be read, so
/// that an unknown path is the path's own fault.
void read_fuzzy(Reading&, TableReader& root, const Node& document, const std::vector<AskedQuantity>& asked,
                bool is_whole);
/// Tries the middle, the ends and the corners of the fuzzy values: the middle and each end alone must give a plan.
void try_samples(const Plan&, const Node& document, Complaints&);
/// A plan from a document; the text of the plan is left empty. Without [fuzzy] if `is_sample`.
Plan read_plan_document(const Node& document, const std::string& name, Complaints&, bool is_sample);

/// Whether bars find room side by side, their axes from -extent to extent.
bool have_room(int count, double diameter, double extent);
inline constexpr double round_off = 1e-9;  // of lengths [m] and times [s] in other units, and of their sums
/// Of a section, what its bars take at most.
inline constexpr double most_steel = 0.15;

/// Index of a named thing; -1 after a complaint, or without one if the name is empty.
int find_named(const std::map<std::string, int>& known, const TableReader&, const std::string& key,
               const std::string& name, const std::string& what);

/// Indices of the members that match one of the patterns, rising; a pattern without a match is a complaint.
std::vector<int> find_members(const Reading&, const TableReader&, const std::string& key, const std::vector<Word>&);

double calc_length(const Member&);

/// Part of a shaft's circumference: `azimuth` and `opening`, all around if neither is given.
struct Sector {
  double azimuth = 0, opening = 0;  // of its middle, its angle [rad]
};
Sector read_sector(TableReader&);
/// Whether the member may have the sector that the table gives; complains.
bool check_sector(const TableReader&, const Member&);

}  // namespace topple::product
