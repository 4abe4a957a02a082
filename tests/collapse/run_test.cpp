#include "collapse/run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "collapse/findings.h"
#include "mbs/model_json.h"
#include "plans.h"
#include "product/templates.h"

namespace topple::collapse {
namespace {

const record::Finding& finding(const record::Record& r, const std::string& id) {
  const auto it = std::find_if(r.findings.begin(), r.findings.end(), [&](const auto& f) { return f.id == id; });
  EXPECT_NE(it, r.findings.end()) << id;
  return *it;
}

std::vector<double> series(const record::Record& r, const std::string& id) {
  for (const record::Series& s : r.series)
    if (s.id == id) return s.value;
  ADD_FAILURE() << id;
  return {};
}

TEST(Run, ARecordIsWhole) {
  const product::Plan plan = read(house(charge("C-A*-0", "0.1 s"), "0.8 s"));
  std::vector<std::string> live;
  RunCallbacks callbacks;
  callbacks.on_event = [&](const record::Event& e) { live.push_back(e.text); };
  const record::Record r = run_plan(plan, default_knowledge(), {}, callbacks);
  const size_t S = r.time.size(), B = r.bodies.size(), Z = r.zones.size();
  EXPECT_GE(S, 48u);
  EXPECT_EQ(r.position.size(), S * B * 3);
  EXPECT_EQ(r.orientation.size(), S * B * 4);
  EXPECT_EQ(r.zone_state.size(), S * Z);
  EXPECT_EQ(r.zone_utilisation.size(), S * Z);
  for (const record::Series& s : r.series) {
    EXPECT_EQ(s.value.size(), S) << s.id;
    for (double v : s.value) ASSERT_TRUE(std::isfinite(v)) << s.id;
  }
  EXPECT_TRUE(std::is_sorted(r.time.begin(), r.time.end()));
  EXPECT_EQ(static_cast<int>(Z), r.counts.force_elements + r.counts.rigid_joints);
  EXPECT_THAT(live, testing::Contains(testing::HasSubstr("stage 1")));
  EXPECT_THAT(live, testing::Contains(testing::HasSubstr("C-A2-0 fired")));
  EXPECT_EQ(live.size(), r.events.size());
  EXPECT_EQ(r.provenance.plan_sha256.size(), 64u);
  EXPECT_LT(r.provenance.step, 1e-3);
}

TEST(Run, TellsHowHardCablesPull) {
  const auto run = [](const std::string& strength) {
    const std::string cable =
        "[[cable]]\nname = \"guy\"\nmember = \"C-B1-1\"\nposition = \"1 m\"\nanchor = [\"40 m\", "
        "\"0 m\", \"0 m\"]\nstiffness = \"50 kN/m\"\npretension = \"5 kN\"\nstrength = \"" +
        strength + "\"\n";
    return run_plan(read(house(charge("C-A*-0", "0.1 s"), "1.5 s") + cable), default_knowledge(), {}, {});
  };
  const record::Record holds = run("1 MN"), breaks = run("20 kN");
  const std::vector<double> pull = series(holds, "cable_guy");
  ASSERT_EQ(pull.size(), holds.time.size());
  EXPECT_NEAR(pull.front(), 5e3, 50) << "the building gives way by 1 mm at most";
  const double most = *std::max_element(pull.begin(), pull.end());
  EXPECT_GT(most, 20e3) << "it falls away from the anchor";
  EXPECT_EQ(finding(holds, "cable.guy").value, most);
  EXPECT_EQ(finding(holds, "cable.guy").status, record::Status::Info);
  EXPECT_THAT(finding(holds, "cable.guy").text,
              testing::HasSubstr(fmt::format("{:.0f} % of its strength", most / 1e4)));
  const record::Finding& broken = finding(breaks, "cable.guy");
  EXPECT_LT(broken.value, 20e3);
  EXPECT_EQ(broken.status, record::Status::Warning);
  EXPECT_THAT(broken.text, testing::HasSubstr(" It breaks at "));
  EXPECT_EQ(series(breaks, "cable_guy").back(), 0);
}

TEST(Run, TellsThePlanAPrintNeeds) {
  const std::string stages = charge("C-A*-0", "0.1 s", "scatter = \"3 ms\"");
  const std::string more =
      "[preparation]\nremoved = [\"S-*-0\"]\n[[preparation.weaken]]\nmembers = [\"C-B1-0\"]\n"
      "at = \"1.5 m\"\ncut_bars = 0.25\ncut_concrete = 0.4\n[[site.neighbour]]\n"
      "name = \"No. 7\"\nfootprint = [[\"40 m\", \"0 m\"], [\"50 m\", \"0 m\"], [\"50 m\", \"9 m\"]]\n"
      "building_class = \"residential\"\n";
  const record::Record r = run_plan(read(house(stages, "0.2 s") + more), default_knowledge(), {}, {});
  const auto value = [&r](const std::string& key, const std::string& part) {
    return std::ranges::any_of(r.plan_values, [&](const record::KeyValue& v) {
      return v.key == key && v.value.find(part) != std::string::npos;
    });
  };
  EXPECT_TRUE(value("Heights of storeys", " m"));
  EXPECT_TRUE(value("floor", "15 cm thick, bars 4 cm2/m at the top and 4 cm2/m at the bottom"));
  EXPECT_TRUE(value("Before the first charge", "S-A1B2-0, S-A2B3-0: taken out."));
  EXPECT_TRUE(value("Before the first charge", "C-B1-0: 25 % of the bars and 40 % of the concrete cut at 1.50 m."));
  EXPECT_TRUE(value("Stage at 0.1 s at 0.1 s", "Its time scatters by 3 ms."));
  EXPECT_TRUE(value("Class of No. 7", "residential buildings (line 2): 5 mm/s"));
}

TEST(Run, TellsChargesThatFailInTheirTurn) {
  const std::string stages = charge("C-A*-0", "0.1 s") + charge("C-B2-0", "0.2 s", "fails = true");
  const product::Plan plan = read(house(stages, "0.5 s"));
  std::vector<double> live;
  std::vector<std::string> texts;
  RunCallbacks callbacks;
  callbacks.on_event = [&](const record::Event& e) { live.push_back(e.time), texts.push_back(e.text); };
  const record::Record r = run_plan(plan, default_knowledge(), {}, callbacks);
  EXPECT_THAT(texts, testing::Contains("the charge of C-B2-0 does not fire"));
  EXPECT_TRUE(std::is_sorted(live.begin(), live.end())) << testing::PrintToString(texts);
  EXPECT_EQ(live.size(), r.events.size());
}

TEST(Run, WhatFailedIsNotVerifiedByItsBalance) {
  RunOptions o;
  o.step = 0.02;
  const record::Record r = run_plan(read(house(charge("C-A*-0", "0.1 s"), "0.5 s")), default_knowledge(), o, {});
  EXPECT_EQ(r.ending, "failed");
  const record::Finding& balance = finding(r, "verification.energy");
  EXPECT_EQ(balance.status, record::Status::Bad);
  EXPECT_TRUE(std::isnan(balance.value));
}

TEST(Run, ListsTheMembersThatTheDeadLoadOverloads) {
  std::string plan = house(charge("C-A*-0", "0.1 s"), "0.5 s");
  const std::string load = "\"1 kN/m2\"";
  plan.replace(plan.find(load), load.size(), "\"90 kN/m2\"");
  const record::Record r = run_plan(read(plan), default_knowledge(), {}, {});
  ASSERT_EQ(r.ending, "failed");
  ASSERT_TRUE(r.time.empty());
  const record::Finding& f = finding(r, "overloads");
  EXPECT_EQ(f.status, record::Status::Bad);
  EXPECT_GT(f.value, 1);
  // the element that the ending names is of the first member, and its load is the largest
  const size_t at = r.ending_text.find("element \"");
  ASSERT_NE(at, std::string::npos) << r.ending_text;
  const std::string element = r.ending_text.substr(at + 9, r.ending_text.find('"', at + 9) - at - 9);
  const std::string worst = element.substr(0, element.find('/'));
  EXPECT_NE(f.text.find(fmt::format("the most loaded first: {} {:.0f} %, ", worst, 100 * f.value)), std::string::npos)
      << f.text;
  EXPECT_NE(r.ending_text.find(fmt::format("loaded to {:.0f} %", 100 * f.value)), std::string::npos) << r.ending_text;
  EXPECT_EQ(f.text.find(worst), f.text.rfind(worst)) << "named once: " << f.text;
}

TEST(Run, OverloadsAreThoseOfMembersThatCrack) {
  // ends of beams are turned by their cracks: uncracked they would be loaded by that alone
  const auto run_with = [](const std::string& section) {
    return run_plan(
        read(materials() + R"toml([concrete.poor]
fc = "9 N/mm2"
Ec = "15 GPa"
[section.thin]
width = "10 cm"
height = "10 cm"
concrete = "poor"
steel = "S"
cover = "15 mm"
ties = { diameter = "4 mm", spacing = "10 cm" }
bars = { count_y = 2, count_z = 2, diameter = "4 mm" }
)toml" + grid("A = \"0 m\", B = \"7 m\", C = \"14 m\"", "1 = \"0 m\", 2 = \"7 m\"", 2, "1 kN/m2") +
             "[[columns]]\nsection = \"column\"\nat = [\"A1\", \"A2\", \"B1\", \"B2\"]\n[[columns]]\nsection = \"" +
             section + "\"\nat = [\"C1\", \"C2\"]\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n" +
             analysis("0.05 s")),
        default_knowledge(), {}, {});
  };
  EXPECT_LT(1 / finding(run_with("column"), "stability.start").value, 1);
  const record::Record r = run_with("thin");
  ASSERT_EQ(r.ending, "failed");
  const std::string list = finding(r, "overloads").text;
  EXPECT_THAT(list, testing::HasSubstr("if they had no limits: 2. Share of the capacity, the most loaded first: C-C"));
  for (const char* sound : {"C-A", "C-B", "B-", "S-"}) EXPECT_EQ(list.find(sound), std::string::npos) << list;
}

TEST(Run, FindingsComeInTheOrderOfTheirWeight) {
  const record::Record r = run_plan(read(house(charge("C-A*-0", "0.1 s"), "0.5 s")), default_knowledge(), {}, {});
  std::vector<std::string> headings;
  for (const record::Finding& f : r.findings)
    if (headings.empty() || headings.back() != f.heading) headings.push_back(f.heading);
  EXPECT_THAT(headings, testing::ElementsAre("Mechanism", "Stability", "Fall and debris", "Touchdown",
                                             "Ground vibration", "Events", "Not modelled", "Verification"));
  EXPECT_LT(finding(r, "verification.equilibrium").value, 1e-6);
}

TEST(Run, SaysInALineOfItsOwnThatNoDistanceIsSafe) {
  const record::Record r = run_plan(read(house(charge("C-A*-0", "0.1 s"), "0.2 s")), default_knowledge(), {}, {});
  EXPECT_EQ(r.not_modelled.back(), "No distance given here is a safe distance.");
  EXPECT_EQ(finding(r, "not_modelled.distances").text, r.not_modelled.back());
  EXPECT_THAT(finding(r, "not_modelled").text, testing::Not(testing::HasSubstr("distance")));
  EXPECT_THAT(finding(r, "not_modelled").text, testing::EndsWith("beyond their weight."));
}

TEST(RunPhysics, AHouseOnItsColumnsStands) {
  const record::Record r = run_plan(read(house("", "0.5 s")), default_knowledge(), {}, {});
  EXPECT_EQ(finding(r, "mechanism").title, "Mechanism: stands");
  const auto height = series(r, "mass_centre_height");
  EXPECT_NEAR(height.back(), height.front(), 1e-6);  // metres; the explicit steps start from the equilibrium
  const auto force = series(r, "ground_force");
  EXPECT_NEAR(force.front() / (calc_standing_mass(read(house())) * 9.81), 1, 1e-6);
}

TEST(RunPhysics, TheMarginAtTheStartIsTheSmallerOfBothAxesOfTheHeads) {
  const auto start = [](const std::string& azimuth) {
    const record::Record r =
        run_plan(read(portal("[criteria]\nazimuth = \"" + azimuth + "\"\nazimuth_tolerance = \"20 deg\"\n")),
                 default_knowledge(), {}, {});
    // of the run itself, whose heads turn about one axis
    const double used = *std::max_element(r.zone_utilisation.begin(),
                                          r.zone_utilisation.begin() + static_cast<std::ptrdiff_t>(r.zones.size()));
    return std::make_pair(finding(r, "stability.start"), 1 / used);
  };
  const auto [along, own_along] = start("180 deg");
  const auto [across, own_across] = start("90 deg");
  // the girder's ends bend the columns about y, whatever the fall is
  EXPECT_EQ(along.value, across.value);
  EXPECT_EQ(along.text, across.text);
  EXPECT_NEAR(along.value / own_along, 1, 1e-6);
  EXPECT_GT(own_across, 1.5 * along.value);
  EXPECT_THAT(along.text, testing::HasSubstr("Heads of ground columns turn about y here; about x the margin is"));
}

TEST(RunPhysics, ZonesThatYieldUnderDeadLoadHaveNoMarginLeft) {
  // heads that turn about one axis yield at another load than those that turn about the other one
  double margin = 10;
  for (const int load : {2, 3, 4, 6, 8}) {
    const auto start = [load](const std::string& azimuth) {
      return run_plan(
          read(materials() +
               grid("A = \"0 m\", B = \"9 m\"", "1 = \"0 m\", 2 = \"4 m\"", 1, std::to_string(load) + " kN/m2") +
               "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = "
               "\"floor\"\n[criteria]\nazimuth = \"" +
               azimuth + "\"\nazimuth_tolerance = \"20 deg\"\n" + analysis("0.05 s")),
          default_knowledge(), {}, {});
    };
    long most = 0;
    for (const char* azimuth : {"180 deg", "90 deg"}) {
      const record::Record r = start(azimuth);
      const record::Finding f = finding(r, "stability.start");
      const auto yielded = std::count(r.zone_state.begin(), r.zone_state.begin() + static_cast<long>(r.zones.size()),
                                      static_cast<std::uint8_t>(record::ZoneState::Yielded));
      most = std::max<long>(most, yielded);
      const bool none = f.text.find("; no zone has yielded.") != std::string::npos;
      EXPECT_TRUE(!none || yielded == 0) << load << " " << azimuth << ": " << f.text;
      EXPECT_EQ(none, load < 4) << f.text;
      EXPECT_EQ(f.status, none ? record::Status::Good : record::Status::Warning) << f.text;
      if (!none) { EXPECT_NEAR(f.value, 1, 1e-6) << f.text; }
      EXPECT_LE(f.value, margin + 1e-6) << load << " " << azimuth;
      margin = f.value;
    }
    EXPECT_EQ(most > 0, load >= 4) << load;
  }
}

TEST(Run, SaysWhatSpansCannotBear) {
  // a slab's zone lies at mid-span, so bars that lack at its supports pass the model unseen
  const auto start = [](const std::string& top) {
    return finding(
        run_plan(
            read(materials() + "[slab.poor]\nthickness = \"18 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\nas_top = \"" +
                 top + "\"\nas_bottom = \"6 cm2/m\"\n" +
                 grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"5.5 m\", 3 = \"12 m\"", 1, "7 kN/m2") +
                 "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = "
                 "\"poor\"\n" +
                 analysis("0.05 s")),
            default_knowledge(), {}, {}),
        "stability.start");
  };
  const record::Finding none = start("0 cm2/m"), enough = start("12 cm2/m");
  EXPECT_EQ(none.status, record::Status::Warning);
  EXPECT_GT(none.value, 1);
  EXPECT_THAT(none.text, testing::HasSubstr("With hinges at both ends and in the middle S-A2B3-0 bears 0.9"));
  EXPECT_THAT(none.text, testing::HasSubstr("it could not stand"));
  EXPECT_THAT(none.text, testing::HasSubstr("So it is with 1 of 5 spans"));
  EXPECT_EQ(enough.text.find("With hinges"), std::string::npos) << enough.text;
}

TEST(RunPhysics, BeamsThatTwistDoNotMakeMasonryYield) {
  // slabs lie on one side of the gable beams; what masonry between them bears is no part of the building's margin
  const auto start = [](const std::string& walls) {
    return finding(run_plan(read(materials() + brick() +
                                 grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"5 m\"", 2, "1 kN/m2") +
                                 "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = "
                                 "\"floor\"\n" +
                                 walls + analysis("0.05 s")),
                            default_knowledge(), {}, {}),
                   "stability.start");
  };
  const record::Finding with = start("[[walls]]\npanel = \"brick\"\nalong = \"x\"\nstoreys = 1\n");
  EXPECT_EQ(with.status, record::Status::Good) << with.text;
  EXPECT_THAT(with.text, testing::HasSubstr("no zone has yielded"));
  EXPECT_NEAR(with.value / start("").value, 1, 0.03);
}

TEST(RunPhysics, WithoutItsFrontRowAHouseTopplesToTheFront) {
  const record::Record r =
      run_plan(read(house("[criteria]\nmechanism = \"topple\"\n" + charge("C-A*-0", "0.1 s"), "2.5 s")),
               default_knowledge(), {}, {});
  const auto tilt = series(r, "tilt_angle"), height = series(r, "mass_centre_height");
  EXPECT_LT(height.back(), height.front() - 0.5);
  EXPECT_GT(*std::max_element(tilt.begin(), tilt.end()), 0.1);
  EXPECT_TRUE(std::any_of(r.events.begin(), r.events.end(), [](const auto& e) { return e.kind == "touchdown"; }));
  EXPECT_LT(finding(r, "verification.energy").value, 0.01);  // what the issue asks for
}

TEST(Run, CriteriaThatAreNotMetAreSaid) {
  const std::string text =
      house("[criteria]\nmechanism = \"stands\"\ndebris_reach = \"100 m\"\n" + charge("C-A*-0", "0.05 s"), "1.5 s");
  const record::Record r = run_plan(read(text), default_knowledge(), {}, {});
  EXPECT_EQ(finding(r, "criterion.mechanism").status, record::Status::Bad);
  EXPECT_EQ(finding(r, "criterion.debris_reach").status, record::Status::Good);
  EXPECT_TRUE(is_violated(finding(r, "criterion.mechanism")));
  EXPECT_FALSE(is_violated(finding(r, "criterion.debris_reach")));
}

TEST(Run, ChargesThatAreLeftLeaveLimitsOpen) {
  const std::string text = house(
      "[criteria]\nmechanism = \"stands\"\ndebris_reach = \"100 m\"\n[[site.neighbour]]\nname = \"Hall\"\n"
      "footprint = [[\"60 m\", \"0 m\"], [\"70 m\", \"0 m\"], [\"70 m\", \"10 m\"]]\nclearance = \"1 m\"\n" +
          charge("C-A*-0", "0.5 s"),
      "1.5 s");
  RunOptions o;
  o.duration = 0.2;
  const record::Record r = run_plan(read(text), default_knowledge(), o, {});
  for (const char* id : {"criterion.mechanism", "criterion.debris_reach", "clearance.Hall"}) {
    EXPECT_EQ(finding(r, id).status, record::Status::NotJudged) << id;
    EXPECT_THAT(finding(r, id).text, testing::EndsWith("had not fired when the run ended.")) << id;
  }
}

TEST(Run, TellsTheValuesOfAPlanWithAShaft) {
  std::vector<Diagnostic> warnings;
  std::string text = product::find_template("chimney").text;
  text +=
      "\n[[site.utility]]\nname = \"Main\"\nfootprint = [[\"-40 m\", \"0 m\"], [\"-38 m\", \"0 m\"], [\"-38 m\", "
      "\"9 m\"]]\nvibration_limit = \"10 mm/s\"\n";
  RunOptions o;
  o.duration = 0.01;
  const record::Record r = run_plan(product::read_plan(text, "chimney.toml", warnings), default_knowledge(), o, {});
  const auto value = [&r](const std::string& key) {
    const auto it =
        std::find_if(r.plan_values.begin(), r.plan_values.end(), [&key](const auto& v) { return v.key == key; });
    return it == r.plan_values.end() ? std::string("none") : it->value;
  };
  EXPECT_EQ(value("Rows"), "none");
  EXPECT_EQ(value("Storeys"), "none");
  EXPECT_THAT(value("Shaft chimney"), testing::StartsWith("60.00 m high, outer diameter 5.00 m at the foot"));
  EXPECT_THAT(value("Mouth at 0.5 s"), testing::HasSubstr(" deg at azimuth 180 deg, "));
  EXPECT_EQ(value("Vibration of Main"), "10 mm/s");
  EXPECT_EQ(value("Mechanism"), "topple");
}

TEST(Run, CancellingEndsAtAStepWithARecord) {
  std::atomic<bool> cancel = false;
  RunCallbacks callbacks;
  callbacks.progress.cancel = &cancel;
  callbacks.progress.report = [&](double done, double) { cancel = done > 0.1; };
  const record::Record r = run_plan(read(house(charge("C-A*-0", "0.05 s"))), default_knowledge(), {}, callbacks);
  EXPECT_EQ(r.ending, "cancelled");
  EXPECT_GT(r.time.back(), 0.09);
  EXPECT_LT(r.time.back(), 0.2);
}

TEST(Run, TouchdownsDoNotHangOnFrames) {
  const product::Plan plan = read(house(charge("C-*-0", "0.05 s"), "1.2 s"));
  const auto run = [&plan](double rate) {
    RunOptions o;
    o.frame_rate = rate;
    return run_plan(plan, default_knowledge(), o, {});
  };
  const record::Record fine = run(1000), coarse = run(30);
  EXPECT_THAT(finding(fine, "touchdown.first").text, testing::HasSubstr("J are in motion"));
  EXPECT_EQ(finding(coarse, "touchdown.first").text, finding(fine, "touchdown.first").text);
  EXPECT_GT(finding(fine, "touchdown.parts").value, 0);
  EXPECT_EQ(finding(coarse, "touchdown.parts").value, finding(fine, "touchdown.parts").value);
}

TEST(Run, TheLargestGroundForceHangsLittleOnFrames) {
  const product::Plan plan = read(house(charge("C-*-0", "0.05 s"), "1.2 s"));
  const auto force = [&plan](double rate) {
    RunOptions o;
    o.frame_rate = rate;
    return finding(run_plan(plan, default_knowledge(), o, {}), "touchdown.force").value;
  };
  const double fine = force(2000);
  EXPECT_GT(fine, 0);
  EXPECT_NEAR(force(200), fine, 0.02 * fine);
  EXPECT_NEAR(force(60), fine, 0.05 * fine);
}

TEST(Recorder, MeansOfAForceAreThoseOfItsImpulse) {
  // 300 N all the time, and a blow of 100 N s within a millisecond
  for (const double rate : {60.0, 200.0, 1000.0}) {
    std::vector<double> time, impulse;
    for (int i = 0; i <= rate; ++i) {
      time.push_back(i / rate);
      impulse.push_back(300 * time.back() + 100 * std::clamp((time.back() - 0.5004) / 0.001, 0.0, 1.0));
    }
    const MeanForce mean = find_largest_mean(time, impulse);
    EXPECT_EQ(mean.window, 0.05);
    EXPECT_NEAR(mean.force, 2300, 1e-6) << rate;
    EXPECT_NEAR(mean.time, 0.5, 0.035) << rate;
  }
  const MeanForce coarse = find_largest_mean({0, 0.2, 0.4, 0.6}, {0, 60, 220, 280});
  EXPECT_DOUBLE_EQ(coarse.window, 0.2);
  EXPECT_NEAR(coarse.force, 800, 1e-9);
  EXPECT_NEAR(coarse.time, 0.3, 1e-12);
  EXPECT_EQ(find_largest_mean({0}, {0}).force, 0);
  // a wait that is passed over says nothing of the landing behind it
  const MeanForce landing = find_largest_mean({0, 4, 4.02, 4.05, 4.07, 4.1}, {0, 400, 402, 420, 422, 424});
  EXPECT_EQ(landing.window, 0.05);
  EXPECT_NEAR(landing.force, 20 / 0.05, 1e-9);
}

TEST(Run, AFrameHasTheVolumeOfItsMaterial) {
  ModelMap map;
  const mbs::Model model = make_model(read(house("", "0.1 s")), default_knowledge(), map);
  double volume = 0;
  for (const BodyEntry& b : map.bodies) volume += b.volume;
  // slabs between the axes but for the columns, beams below them between the columns, walls below the beams
  const double columns = 6 * 0.3 * 0.4 * 6, slabs = 2 * 2 * (5 * 4 - 0.3 * 0.4) * 0.15;
  const double beams = 2 * 0.3 * (4.7 * (2 * 0.425 + 0.35) + 4 * 3.6 * 0.425);
  const double walls = 0.1 * (2 * (4.7 * 2.5 - 1.2) + 4 * (3.6 * 2.5 - 1.2));
  EXPECT_NEAR(volume, columns + slabs + beams + walls, 1e-9);
  EXPECT_GT(map.mass, 1.05 * 2500 * volume) << "floor loads have none";
}

TEST(RunReplay, TheModelFileRunsAgainToTheSamePoses) {
  const product::Plan plan = read(house(charge("C-A*-0", "0.05 s"), "0.6 s"));
  std::string file;
  RunCallbacks callbacks;
  callbacks.on_model = [&](const mbs::Model& m, const ModelMap&, const record::Counts&) { file = mbs::to_json(m); };
  const record::Record a = run_plan(plan, default_knowledge(), {}, callbacks);
  RunOptions again;
  again.duration = 0.6;
  again.stability_share = settings_of(plan, default_knowledge(), {}).stability_share;
  const record::Record b = run_model(mbs::model_from_json(file, "model.json"), again, {});
  ASSERT_EQ(a.time, b.time);
  const size_t A = a.bodies.size(), B = b.bodies.size();
  for (size_t s = 0; s < a.time.size(); ++s)
    for (size_t i = 0; i < 3 * B; ++i) ASSERT_EQ(a.position[s * 3 * A + i], b.position[s * 3 * B + i]);
}

TEST(RunReplay, TheModelFileSaysHowItsPlanWasRun) {
  const product::Plan plan = read(house(charge("C-A*-0", "0.05 s"), "0.5 s"));
  const Knowledge& k = default_knowledge();
  RunOptions options;
  options.frame_rate = 25;
  std::string file;
  RunCallbacks callbacks;
  callbacks.on_model = [&](const mbs::Model& m, const ModelMap&, const record::Counts&) {
    file = mbs::to_json(m, settings_of(plan, k, options));
  };
  const record::Record a = run_plan(plan, k, options, callbacks);
  mbs::RunSettings s;
  const mbs::Model m = mbs::model_from_json(file, "model.json", &s);
  EXPECT_EQ(s.duration, 0.5);
  EXPECT_EQ(s.equilibrium, true);
  EXPECT_EQ(s.rest_speed, k.rest_speed);
  RunOptions again;
  again.duration = s.duration;
  again.step = s.step;
  again.stability_share = s.stability_share;
  again.frame_rate = 1 / s.frame_interval;
  const record::Record b = run_model(m, again, {});
  EXPECT_EQ(a.time, b.time);
}

TEST(RunReplay, ThreadsDoNotChangeTheResult) {
  const product::Plan plan = read(house(charge("C-A*-0", "0.05 s"), "0.6 s"));
  std::vector<float> first;
  for (int threads : {1, 2, 4}) {
    RunOptions o;
    o.threads = threads;
    const record::Record r = run_plan(plan, default_knowledge(), o, {});
    if (first.empty()) first = r.position;
    EXPECT_EQ(r.position, first) << threads;
  }
}

std::string neighbour(const std::string& name, const std::string& x0, const std::string& x1,
                      const std::string& more = "") {
  return "[[site.neighbour]]\nname = \"" + name + "\"\nfootprint = [[\"" + x0 + "\", \"0 m\"], [\"" + x1 +
         "\", \"0 m\"], [\"" + x1 + "\", \"1 m\"], [\"" + x0 + "\", \"1 m\"]]\n" + more;
}

TEST(Run, ANeighbourIsSaidToBeUnderWhatDoesNotComeDownThere) {
  const record::Record r =
      run_plan(read(house(neighbour("under", "2 m", "3 m") + neighbour("foot", "-1 m", "1 m"), "0.05 s")),
               default_knowledge(), {}, {});
  EXPECT_THAT(finding(r, "clearance.under").text, testing::StartsWith("Nothing lands on it, but parts are over it: "));
  EXPECT_THAT(finding(r, "clearance.under").text, testing::HasSubstr(" comes down to 2.5 m above the ground there"));
  EXPECT_EQ(finding(r, "clearance.foot").text, "C-A1-0 stands on it from the start.");
  EXPECT_THAT(finding(r, "verification.step").text, testing::HasSubstr(" Joints drift by at most "));
  // what a charge leaves and throws out is the column until then
  const record::Record fired = run_plan(
      read(house(neighbour("foot", "-1 m", "1 m") + neighbour("front", "-9 m", "-4 m") + charge("C-A*-0", "0.05 s"),
                 "0.06 s")),
      default_knowledge(), {}, {});
  EXPECT_EQ(finding(fired, "clearance.foot").text, "C-A1-0 stands on it from the start.");
  EXPECT_THAT(finding(fired, "clearance.front").text, testing::MatchesRegex("[A-Z]-[A-Z0-9]*-[01] stands 3.[0-9] m "
                                                                            "away from the start, and nothing has come "
                                                                            "nearer."));
}

TEST(Run, ANeighbourThatAsksForNothingOnItIsBrokenByWhatLands) {
  const std::string none = "clearance = \"0 m\"\n";
  const record::Record r =
      run_plan(read(house(neighbour("under", "2 m", "3 m", none) + neighbour("foot", "-1 m", "1 m", none) +
                              neighbour("beside", "30 m", "31 m", none) + neighbour("silent", "-1 m", "1 m"),
                          "0.05 s")),
               default_knowledge(), {}, {});
  EXPECT_EQ(finding(r, "clearance.under").status, record::Status::Warning);
  EXPECT_EQ(finding(r, "clearance.foot").status, record::Status::Bad);
  EXPECT_EQ(finding(r, "clearance.beside").status, record::Status::Good);
  EXPECT_EQ(finding(r, "clearance.silent").status, record::Status::Warning);
}

TEST(Run, WhatMayStillBeBrokenWhenTheTimeIsOverIsNotJudged) {
  const auto run_for = [](const std::string& duration) {
    return run_plan(read(house(charge("C-A*-0", "0.05 s") + neighbour("near", "-4 m", "-3 m", "clearance = \"1 m\"\n") +
                                   neighbour("far", "100 m", "101 m", "clearance = \"1 m\"\n") +
                                   "[criteria]\ndebris_reach = \"8 m\"\n",
                               duration)),
                    default_knowledge(), {}, {});
  };
  const record::Record early = run_for("0.5 s");
  for (const std::string id : {"clearance.near", "criterion.debris_reach"}) {
    EXPECT_TRUE(is_not_judged(finding(early, id))) << id;
    EXPECT_THAT(finding(early, id).text, testing::HasSubstr("m/s when the run ended, and may break this limit.")) << id;
  }
  EXPECT_EQ(finding(early, "clearance.far").status, record::Status::Good);
  // it has just begun to fall: no part is fast yet
  const record::Record at_once = run_for("0.06 s");
  for (const std::string id : {"clearance.near", "criterion.debris_reach"}) {
    EXPECT_TRUE(is_not_judged(finding(at_once, id))) << id;
    EXPECT_THAT(finding(at_once, id).text,
                testing::HasSubstr("Not judged: it had not come to rest when the run ended, and "))
        << id;
  }
  EXPECT_EQ(finding(at_once, "clearance.far").status, record::Status::Good);
  const record::Record late = run_for("40 s");
  EXPECT_EQ(late.ending, "at_rest");
  for (const record::Finding& f : late.findings) EXPECT_FALSE(is_not_judged(f)) << f.id;
}

TEST(Run, AMechanismIsNotJudgedBeforeItIsFinal) {
  const record::Record r =
      run_plan(read(house("[criteria]\nmechanism = \"stands\"\n" + charge("C-A*-0", "0.05 s"), "0.2 s")),
               default_knowledge(), {}, {});
  EXPECT_TRUE(is_not_judged(finding(r, "criterion.mechanism"))) << finding(r, "criterion.mechanism").text;
  EXPECT_EQ(finding(r, "mechanism").status, record::Status::NotJudged);
}

TEST(Run, WhatWasAskedIsNotBrokenBeforeItIsFinal) {
  const auto run_for = [](const std::string& fired, double duration) {
    product::Plan plan =
        read(house("[criteria]\nmechanism = \"topple\"\nazimuth = \"169.9 deg\"\nazimuth_tolerance = \"7.5 "
                   "deg\"\ndebris_reach = \"50 m\"\n" +
                       charge("C-A*-0", fired),
                   "1 s"));
    plan.analysis.duration = duration;
    return run_plan(plan, default_knowledge(), {}, {});
  };
  const record::Record before = run_for("0.5 s", 0.2), falling = run_for("0.05 s", 0.2);
  for (const std::string id : {"criterion.mechanism", "criterion.azimuth"}) {
    EXPECT_TRUE(is_not_judged(finding(before, id))) << finding(before, id).text;
    EXPECT_THAT(finding(before, id).text, testing::EndsWith("Not judged: 3 charges had not fired when the run ended."));
    EXPECT_TRUE(is_not_judged(finding(falling, id))) << finding(falling, id).text;
    EXPECT_THAT(finding(falling, id).text,
                testing::EndsWith("Not judged: it had not come to rest when the run ended."));
  }
  EXPECT_EQ(finding(before, "mechanism").status, record::Status::NotJudged);
  EXPECT_TRUE(is_not_judged(finding(before, "criterion.debris_reach"))) << "nothing has come down that could reach it";
  EXPECT_THAT(finding(before, "criterion.azimuth").text, testing::StartsWith("Asked: 169.9 deg +- 7.5 deg; "));
}

TEST(Run, ComparesNoRigidBlockAskewToItsHinges) {
  const auto block = [](const std::string& azimuth) {
    const record::Record r = run_plan(read(house(charge("C-A*-0", "0 s") + "[criteria]\nazimuth = \"" + azimuth +
                                                     "\"\nazimuth_tolerance = \"90 deg\"\n",
                                                 "1.2 s")),
                                      default_knowledge(), {}, {});
    return finding(r, "rigid_block").text;
  };
  EXPECT_THAT(block("180 deg"), testing::HasSubstr("a rigid block in its place ("));
  // all of the row behind, also where the fall lies a little askew to the grid
  EXPECT_THAT(block("180 deg"), testing::HasSubstr(" 3 plastic hinges "));
  EXPECT_THAT(block("175 deg"), testing::HasSubstr(" 3 plastic hinges "));
  EXPECT_THAT(block("136 deg"), testing::StartsWith("No comparison: the heads of the columns turn about an axis"));
}

// The row that lets the block go fires last, but its stage need not begin last.
TEST(Run, LetsTheRigidBlockGoWithTheLastCharge) {
  const auto block = [](const std::string& stages) {
    const record::Record r =
        run_plan(read(house(stages + "[criteria]\nazimuth = \"180 deg\"\nazimuth_tolerance = \"15 deg\"\n", "1.6 s")),
                 default_knowledge(), {}, {});
    return finding(r, "rigid_block").text;
  };
  const auto at = [](const std::string& time) { return "[[stage]]\ntime = \"" + time + "\"\n"; };
  const std::string row = charge("C-A*-0", "0 s", "scatter = \"0 s\"");
  const std::string fire = row.substr(row.find("[[stage.charge]]"));
  const std::string little =
      "[[stage.charge]]\nmembers = \"C-B1-1\"\nposition = \"1.2 m\"\ndestroyed_length = \"10 cm\"\nresidual_bars = 1\n";
  const std::string stages = block(at("0.2 s") + little + at("0.4 s") + fire);
  EXPECT_THAT(stages, testing::HasSubstr("would lean by"));
  EXPECT_EQ(block(at("0.1 s") + fire + "delay = \"0.3 s\"\n" + at("0.2 s") + little), stages);
}

TEST(Run, TellsThatFramesAreFarApart) {
  const auto run_at = [](double rate) {
    RunOptions o;
    o.frame_rate = rate;
    return run_plan(read(house(charge("C-A*-0", "0.05 s"), "0.3 s")), default_knowledge(), o, {});
  };
  EXPECT_THAT(finding(run_at(10), "verification.frames").text,
              testing::ContainsRegex("^Frames are 0\\.(1|0999) s apart: "));
  const record::Record close = run_at(60);
  for (const record::Finding& f : close.findings) EXPECT_NE(f.id, "verification.frames");
}

TEST(Run, TellsWhereDamageBesideChargesChangesNothing) {
  const auto note = [](const std::string& position, const std::string& length) {
    const record::Record r =
        run_plan(read(house("[[stage]]\ntime = \"0 s\"\n[[stage.charge]]\nmembers = \"C-A*-0\"\nposition = \"" +
                                position + "\"\ndestroyed_length = \"" + length + "\"\ntransition_damage = 0.5\n",
                            "0.05 s")),
                 default_knowledge(), {}, {});
    for (const record::Finding& f : r.findings)
      if (f.text.find("transition_damage") != std::string::npos) return f.text;
    return std::string();
  };
  EXPECT_THAT(note("0.5 m", "0.4 m"), testing::HasSubstr("near enough: 3 (the first is C-A1-0)."));
  EXPECT_EQ(note("1.9 m", "0.8 m"), "");
}

TEST(Run, ALimitThatIsJustBrokenShowsIt) {
  // columns reach to 5.15 m
  const record::Record r =
      run_plan(read(house(neighbour("near", "9.99 m", "20 m", "clearance = \"4.849 m\"\n"), "0.05 s")),
               default_knowledge(), {}, {});
  EXPECT_EQ(finding(r, "clearance.near").status, record::Status::Bad);
  EXPECT_THAT(finding(r, "clearance.near").text, testing::HasSubstr(" stands 4.840 m away from the start"));
  EXPECT_THAT(finding(r, "clearance.near").text, testing::HasSubstr("the limit is 4.849 m."));
}

TEST(Run, ChargesThatFailAreNotCountedAsFired) {
  const record::Record r =
      run_plan(read(house(charge("C-A1-0", "0 s") + charge("C-A2-0", "0.02 s", "fails = true"), "0.05 s")),
               default_knowledge(), {}, {});
  EXPECT_THAT(finding(r, "events").text, testing::StartsWith("Charges: 1; "));
  EXPECT_THAT(finding(r, "events").text, testing::EndsWith(" 1 charge fails, as the plan says."));
}

TEST(Run, StagesSayHowManyOfTheirChargesFail) {
  const auto stage_of = [](const std::string& stage) {
    for (const record::Event& e : run_plan(read(house(stage, "0.05 s")), default_knowledge(), {}, {}).events)
      if (e.kind == "stage") return e.text;
    return std::string();
  };
  const auto more = [](const std::string& members, const std::string& fails) {
    return "[[stage.charge]]\nmembers = \"" + members +
           "\"\nposition = \"1 m\"\ndestroyed_length = \"1 m\"\nfails = " + fails + "\n";
  };
  EXPECT_EQ(stage_of(charge("C-A1-0") + more("C-A2-0", "false")), "stage 1 \"Stage at 0 s\": 2 charges");
  EXPECT_EQ(stage_of(charge("C-A1-0") + more("C-A2-0", "true")), "stage 1 \"Stage at 0 s\": 2 charges, 1 fails");
  EXPECT_EQ(stage_of(charge("C-A1-0") + more("C-B*-0", "true")), "stage 1 \"Stage at 0 s\": 4 charges, 3 fail");
}

TEST(Run, TellsOfAPieceBetweenTwoGaps) {
  const auto note = [](const std::string& second, const std::string& more = "") {
    const std::string stage =
        "[[stage]]\ntime = \"0 s\"\n[[stage.charge]]\nmembers = \"C-A2-0\"\nposition = \"0.6 m\"\n"
        "destroyed_length = \"0.4 m\"\n[[stage.charge]]\nmembers = \"C-A2-0\"\nposition = \"" +
        second + "\"\ndestroyed_length = \"0.4 m\"\n" + more;
    for (const record::Finding& f : run_plan(read(house(stage, "0.05 s")), default_knowledge(), {}, {}).findings)
      if (f.title == "Piece between two gaps") {
        EXPECT_EQ(f.status, record::Status::Warning);
        return f.text;
      }
    return std::string();
  };
  EXPECT_THAT(note("2 m"),
              testing::EndsWith("1 (the first is C-A2-0). What stands on C-A2-0 falls by both gaps and the "
                                "piece, 1.80 m; the gaps alone have 0.80 m."));
  EXPECT_EQ(note("1 m"), "") << "one gap";
  EXPECT_EQ(note("2 m", "fails = true\n"), "");
}

TEST(Run, NoRigidBlockStandsBesideChargesAboveTheGroundStorey) {
  const auto has_block = [](const std::string& members) {
    const record::Record r = run_plan(read(house(charge(members), "0.05 s")), default_knowledge(), {}, {});
    return std::any_of(r.series.begin(), r.series.end(),
                       [](const auto& s) { return s.id == "tilt_angle_rigid_block"; });
  };
  EXPECT_TRUE(has_block("C-A*-0"));
  EXPECT_FALSE(has_block("C-A*-1"));
}

}  // namespace
}  // namespace topple::collapse
