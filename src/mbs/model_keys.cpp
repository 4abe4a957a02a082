/// The keys of the model's file (model_json.h).

#include "mbs/model_json.h"

namespace topple::mbs {

const std::vector<KeyList>& model_json_keys() {
  static const std::vector<KeyList> lists = {
      {"model",
       {"format", "version", "name", "run", "gravity", "damping_frequency", "is_planar", "bodies", "joints", "elements",
        "rotational_elements", "laws", "cables", "springs", "rotational_springs", "bushings", "loads", "contact",
        "events", "outputs"}},
      {"run", {"duration", "step", "frame_interval", "equilibrium", "rest_speed"}},
      {"pose", {"p", "q", "axis", "angle"}},
      {"shape", {"box", "sphere", "hull", "plane", "X_BS"}},
      {"body", {"name", "mass", "inertia", "X_WB", "v_WB", "w_WB", "fixed", "shapes"}},
      {"joint",
       {"kind", "name", "parent", "child", "X_PF", "X_CM", "at", "axis", "axes", "x", "points", "tension_limit",
        "shear_limit", "moment_limit", "rotation_limit"}},
      {"element",
       {"name", "a", "b", "X_AF", "X_BM", "at", "axis", "x", "translational_stiffness", "rotational_stiffness",
        "damping_ratio", "stations"}},
      {"station", {"x", "law"}},
      {"rotational_element", {"name", "joint", "stiffness", "damping_ratio", "law"}},
      {"curve", {"x", "f"}},
      {"family", {"normal_force", "plastic_rotation", "positive", "negative"}},
      {"law",
       {"name", "moment_y", "moment_z", "biaxial_exponent", "damage_share", "rupture_rotation", "compression",
        "tension", "crush_length", "rupture_elongation", "shear_y", "shear_z", "shear_friction", "slip_softening",
        "slip_rupture", "torsion", "twist_rupture"}},
      {"cable", {"name", "a", "b", "p_A", "p_B", "points", "stiffness", "pretension", "strength"}},
      {"characteristic", {"polynomial", "table"}},
      {"table", {"x", "f"}},
      {"spring",
       {"name", "a", "b", "p_A", "p_B", "points", "free_length", "spring", "damper", "tension_strength",
        "compression_strength"}},
      {"rotational_spring", {"name", "joint", "free_angle", "spring", "damper", "strength"}},
      {"bushing", {"name", "a", "b", "X_AF", "X_BM", "at", "axis", "x", "spring", "damper", "strength"}},
      {"load", {"name", "body", "p_B", "at", "force", "torque", "follows_body", "table"}},
      {"load_table", {"time", "factor"}},
      {"contact",
       {"normal", "offset", "friction", "restitution", "body_friction", "body_restitution", "contact_frequency",
        "ground", "bodies", "pairs"}},
      {"pair", {"a", "b", "touches", "friction", "restitution", "stiffness", "damping"}},
      {"trigger",
       {"body", "joint", "element", "bushing", "spring", "rotational_spring", "cable", "quantity", "component",
        "rises_to", "falls_to"}},
      {"output",
       {"name", "body", "joint", "element", "bushing", "spring", "rotational_spring", "cable", "quantity", "rate"}},
      {"action",
       {"do", "element", "rotational", "joint", "body", "cable", "spring", "rotational_spring", "bushing", "load",
        "law", "ramp", "stiffness_share", "replacement"}},
      {"event", {"time", "name", "when", "actions"}},
  };
  return lists;
}

}  // namespace topple::mbs
