#pragma once
/// Words of the model's file, shared by its reader and its writer.

#include <string>
#include <vector>

namespace topple::mbs {

inline constexpr const char* kModelFormat = "topple-mbs";
inline constexpr int kModelVersion = 2;  // 1 knew fixed and revolute joints, boxes and spheres only

/// In the order of Joint::Kind.
inline const std::vector<std::string> kJointWords = {"fixed",     "revolute",    "spherical", "universal",
                                                     "prismatic", "cylindrical", "distance"};
/// In the order of Action::Kind.
inline const std::vector<std::string> kActionWords = {
    "remove_element",           "switch_law",     "release_joint", "replace_body", "release_cable", "remove_spring",
    "remove_rotational_spring", "remove_bushing", "remove_load",   "apply_load",   "loosen_joint"};
/// In the order of Trigger::component.
inline const std::vector<std::string> kComponentWords = {"x", "y", "z", "magnitude"};

}  // namespace topple::mbs
