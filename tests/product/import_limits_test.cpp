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

}  // namespace
}  // namespace topple::product
