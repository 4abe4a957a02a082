#include "study_text.h"

#include <gtest/gtest.h>

namespace topple::apps {
namespace {

TEST(StudyText, ShowsBoundsOfARunningStudyInTheUnitsOfItsResults) {
  study::Problem p;
  p.outputs = {{"lean", "deg", 0.0174532925199433}, {"share", "", 1}};
  study::StudyResult r;
  r.outputs = {"lean", "share"};
  r.alpha.outputs.resize(2);
  for (auto& o : r.alpha.outputs) o.levels.resize(1);
  r.alpha.outputs[0].levels[0].lower.value = -0.0174532925199433;
  r.alpha.outputs[0].levels[0].upper.value = 2 * 0.0174532925199433;
  r.alpha.outputs[1].levels[0].upper.value = 0.5;
  study::StudyState s;
  s.done = 20, s.running = 2, s.run_here = 20, s.seconds = 10, s.limit = 100;
  EXPECT_EQ(describe_state(p, s), "20 done, 2 running, 0 failed, 2/s, at most 40 s left");
  s.so_far = &r;
  EXPECT_EQ(describe_state(p, s),
            "20 done, 2 running, 0 failed, 2/s, at most 40 s left; lean -1 to 2 deg; share 0 to 0.5");
}

}  // namespace
}  // namespace topple::apps
