// Names, numbers and units that a plan cannot hold as they are: each import is an error or a plan that reads.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "ifc_writer.h"
#include "product/plan.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

/// Four columns of the material, one storey.
Import import_of(const std::string& material) {
  Writer w;
  w.metres();
  std::string columns;
  for (const double x : {0.0, 6.0})
    for (const double y : {0.0, 5.0})
      columns += (columns.empty() ? "" : ",") + w.element("IFCCOLUMN", w.placement("$", x, y, 0),
                                                          w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)));
  w.material(material, columns);
  return import("IFC4", w);
}

TEST(ImportIfcClasses, AreReadInNamesOfAnyLength) {
  EXPECT_THAT(import_of("Beton C 25 / 30 XC1").text, HasSubstr("fc = \"25 N/mm2\""));
  EXPECT_THAT(import_of("Concrete C100/115").text, HasSubstr("fc = \"100 N/mm2\""));
  EXPECT_THAT(import_of("C" + std::string(300000, ' ') + "20/25").text, HasSubstr("fc = \"20 N/mm2\""));
  for (const std::string& none :
       {"C" + std::string(400, '9') + "/1", std::string("C999/1000"), std::string("C0/0"), std::string("C25/20"),
        std::string("ABC25/30"), std::string("C25"), std::string("C/30"), "C" + std::string(300000, '2') + "/25"}) {
    const Import made = import_of(none);
    EXPECT_THAT(made.text, HasSubstr("fc = \"?\"\nEc = \"?\"")) << none.substr(0, 40);
    EXPECT_THAT(made.report.missing, Contains(HasSubstr(": fc and Ec"))) << none.substr(0, 40);
  }
}

TEST(ImportIfcClasses, LeaveAGapForATensileStrengthThatHasNoFormula) {
  EXPECT_THAT(import_of("C8/10").text, HasSubstr("fct = \"?\""));
  EXPECT_THAT(import_of("C12/15").text, Not(HasSubstr("fct")));
}

/// Complaints of a plan that are no gaps.
std::vector<std::string> faults(const std::string& plan) {
  std::vector<std::string> out;
  try {
    std::vector<Diagnostic> warnings;
    (void)read_plan(plan, "plan.toml", warnings);
  } catch (const InputError& e) {
    for (const Diagnostic& d : e.diagnostics())
      if (d.code != "E211") out.push_back(d.code + " " + d.message);
  }
  return out;
}

TEST(ImportIfcNames, OfMaterialsThatLookAlikeAsKeysStayApart) {
  Writer w;
  w.metres();
  const std::string same(40, 'a');
  // in other scripts, too: two characters of Chinese
  for (const std::string& name : {std::string("C20/25"), std::string("C20-25"), std::string("\\X2\\6DF7\\X0\\"),
                                  std::string("\\X2\\6DF8\\X0\\"), same + "1", same + "2", std::string("C20_25_2")}) {
    static int x = 0;
    w.material(name, w.element("IFCCOLUMN", w.placement("$", 5 * x++, 0, 0),
                               w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3))));
  }
  const Import made = import("IFC4", w);
  EXPECT_THAT(faults(made.text), testing::IsEmpty());
  for (const char* key : {"C20_25]", "C20_25_2]", "___]", "____2]", "C20_25_2_2]"})
    EXPECT_THAT(made.text, HasSubstr(std::string("[section.column_400x400_") + key)) << key;
  EXPECT_THAT(made.text, HasSubstr("[concrete.C20_25]  # \"C20/25\" in the file"));
  EXPECT_THAT(made.text, HasSubstr("[concrete.C20_25_2]  # \"C20-25\" in the file\nfc = \"?\""));
}

TEST(ImportIfcNames, AreCutBetweenCharactersAndHoldNoControls) {
  for (const std::string& name :
       {std::string(79, 'a') + "\\X\\E4", "x" + std::string(60, '\xE4'), std::string("a\\X\\7Fb\\X\\0Ac\"d")}) {
    Writer w;
    w.metres();
    w.add("IFCBUILDING('g',$,'" + name + "',$,$,$,$,$,.ELEMENT.,$,$,$)");
    add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
    EXPECT_THAT(faults(import("IFC4", w).text), testing::IsEmpty()) << name;
    EXPECT_THAT(faults(import_of(name).text), testing::IsEmpty()) << name;
  }
  Writer w;
  w.metres();
  add_columns(w, "$", [&] { return w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)); });
  EXPECT_THAT(faults(make_plan_text(read_ifc(ifc_file("IFC4", w.str()), "b"), "\xE4\n\x7F.ifc").text),
              testing::IsEmpty())
      << "names of files";
}

TEST(ImportDxfNames, HoldNoControlsAndAreOnesOwn) {
  std::string drawing = "0\nSECTION\n2\nENTITIES\n";
  for (const char* layer : {"", "outline", "a\x7F", "a", "a 1"})
    drawing += std::string("0\nLWPOLYLINE\n8\n") + layer + "\n70\n1\n10\n0\n20\n50\n10\n9\n20\n50\n10\n9\n20\n59\n";
  const std::string text = make_site_text(drawing + "0\nENDSEC\n0\nEOF\n", "s\n.dxf", 0).text;
  EXPECT_THAT(faults(text), testing::IsEmpty());
  for (const char* name : {"outline 1", "outline 2", "a 1", "a 2", "a 1 1"})
    EXPECT_THAT(text, HasSubstr(std::string("name = \"") + name + "\"")) << name;
}

}  // namespace
}  // namespace topple::product
