#pragma once
/// A record in which every field differs from its default and from its neighbours, with awkward values.

#include <cmath>
#include <limits>
#include <string>

#include "record/record.h"

namespace topple::record {

inline Record make_sample() {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Record r;
  r.provenance = {.title = "Weida — \"storehouse\", east",
                  .plan_path = "examples/weida/plan.toml",
                  .plan_text = "title = \"x\"\r\n# größe\n",
                  .plan_sha256 = "ba7816bf",
                  .program_version = "0.1.0",
                  .engine = "native",
                  .machine = "x86-64, 2 cores",
                  .created = "2024-05-06T07:08:09Z",
                  .seed = std::numeric_limits<std::uint64_t>::max(),
                  .step = 0.1,
                  .wall_time = std::numeric_limits<double>::denorm_min(),
                  .threads = 3};
  r.counts = {255, 19, 43, 640, 2, 1.25e6};
  r.plan_values = {{"building", "height", "22 m"}, {"charges", "stage 1", "250 ms"}};
  for (int b = 0; b < 5; ++b) {
    BodyInfo body;
    body.name = "C-A" + std::to_string(b) + "-0";
    body.kind = b % 2 == 0 ? "column" : "";
    body.storey = b - 1;
    body.mass = 1000.0 / (b + 3);
    body.fixed = b == 4;
    if (b == 2) body.belongs = Belonging::Beside;
    for (int k = 0; k < b % 3; ++k)  // none, one or two
      body.shapes.push_back({{{0.1 * b, -0.0, 1.0 / 3}, exp_rotation({0.1 * k, 0.2, 0.3})},
                             {0.2, 0.3 + b, 1.5 + k},
                             k == 0 ? "concrete" : "masonry"});
    r.bodies.push_back(body);
  }
  for (int z = 0; z < 3; ++z)
    r.zones.push_back({"C-A" + std::to_string(z) + "-0/foot",
                       "C-A0-0",
                       "six-component element",
                       z - 1,
                       z,
                       {1.0 / (z + 1), std::nan(""), inf}});
  r.neighbours = {
      {"Mill Street 4", {{0.1, 0.2}, {3, 0.4}, {5, 6}}, false}, {"none", {}, true}, {"main", {{1, 2}}, true}};
  r.building_outline = {{0, 0}, {18.5, 0}, {18.5, 12.25}, {0, 12.25}};
  r.crushed_ends = {{1, 0, 2, -1}, {2, 1, 0, 1}};
  const std::size_t frames = 700;
  for (std::size_t s = 0; s < frames; ++s) {
    r.time.push_back(0.016 * static_cast<double>(s) - 1);
    for (std::size_t b = 0; b < r.bodies.size(); ++b) {
      const auto x = static_cast<float>(s * r.bodies.size() + b);
      for (int k = 0; k < 3; ++k) r.position.push_back(std::sin(x + static_cast<float>(k)) / 3);
      for (int k = 0; k < 4; ++k) r.orientation.push_back(std::cos(x * static_cast<float>(k + 1)) / 7);
    }
    for (const float rate : {0.0F, 1e-3F}) r.crushed_length.push_back(rate * static_cast<float>(s));
    for (std::size_t z = 0; z < r.zones.size(); ++z) {
      r.zone_state.push_back(static_cast<std::uint8_t>((s + z) % 5));
      r.zone_utilisation.push_back(static_cast<float>(s) / static_cast<float>(7 + z));
    }
  }
  r.position[4] = std::numeric_limits<float>::quiet_NaN();
  r.position[5] = -0.0F;
  r.zone_utilisation[1] = std::numeric_limits<float>::infinity();
  r.series = {{"tilt_angle", "Tilt angle", "rad", "angle", {}},
              {"energy/kinetic", "Kinetic, energy", "J", "energy", {}}};
  for (std::size_t s = 0; s < frames; ++s) {
    r.series[0].value.push_back(std::sqrt(static_cast<double>(s)));
    r.series[1].value.push_back(s == 3 ? std::nan("") : -1e300 / static_cast<double>(s + 1));
  }
  r.outputs = {{"empty", "force of cable c", "N", "", {"force"}, {}, {}},
               {"reaction [top]",
                "force of joint \"top\"",
                "N",
                "F",
                {"x", "y", "z"},
                {0, 0.25},
                {1, -0.0, std::nan(""), inf, 5, 6}},
               {"tilt", "orientation of body größe", "1", "world", {"w", "x", "y", "z"}, {0}, {1, 0, 0, 0}},
               {"y long", "length of spring s", "m", "", {"length"}, {}, {}}};
  for (std::size_t i = 0; i < 2000; ++i) {
    r.outputs[3].time.push_back(static_cast<double>(i) / 3);
    r.outputs[3].value.push_back(std::sqrt(static_cast<double>(i)));
  }
  r.events = {{0.0, "stage", "1", "Stage 1 fires."},
              {1.0 / 3, "rupture", "C-A0-0/foot", "The zone \"foot\" breaks,\nits bars rupture."},
              {inf, "rest", "", ""}};
  r.findings = {{"mechanism", "Mechanism", "Mechanism", "The building topples to 12°.", 0.21, "rad", Status::Good},
                {"reach", "Debris", "Reach", "", std::nan(""), "", Status::Bad},
                {"stand", "Stages", "Stands", "Yes.", -0.0, "m", Status::Warning},
                {"criterion.azimuth", "Criteria", "Direction", "", 0.1, "rad", Status::NotJudged}};
  r.not_modelled = {"air blast", "", "dust"};
  r.ending = "time_limit";
  r.ending_text = "The time limit of 10 s was reached.";
  return r;
}

}  // namespace topple::record
