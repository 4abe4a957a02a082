#pragma once
/// A tree of mobilizers with loops in Simbody's terms and numbers in plain arrays. Simbody 3.7's headers do not compile
/// as C++20, so this header and its source are C++17 and know nothing of the rest of topple. SI; all in the ground's
/// frame unless stated.

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace topple::engines::simbody {

using Three = std::array<double, 3>;

struct Frame {
  Three p{};                                           // [m]
  std::array<double, 9> R{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row by row
};

/// Of a body's frame B: where it is, how its origin moves and how it turns.
struct BodyMotion {
  Frame X;
  Three v{}, w{};  // [m/s, rad/s]
};

/// On a body about the origin of B, or a reaction.
struct Wrench {
  Three force{}, torque{};  // [N, N·m]
};

enum class Kind { Fixed, Revolute, Spherical, Universal, Prismatic, Cylindrical, Distance, Free };

/// A body and how it moves against the one before it.
struct Mobilizer {
  Kind kind = Kind::Free;
  int inboard = -1;                     // index of an earlier mobilizer; -1: the ground
  bool reversed = false;                // the joint is described from this body to the inboard one
  Frame inboard_frame, outboard_frame;  // of the joint, in the two bodies
  double mass = 1;                      // [kg]
  Three centre{};                       // in B [m]
  std::array<double, 6> inertia{};      // about the centre, axes of B: xx yy zz xy xz yz [kg·m²]
};

/// A joint that closes a loop.
struct Closure {
  Kind kind = Kind::Fixed;
  int parent = -1, child = -1;  // mobilizers; -1: the ground
  Frame parent_frame, child_frame;
  double distance = 0;  // [m]
};

struct Description {
  Three gravity{};  // [m/s²]
  std::vector<Mobilizer> mobilizers;
  std::vector<Closure> closures;
};

/// Forces at a state, and their powers [W].
using ForceFunction = std::function<void(double time, const std::vector<BodyMotion>&, std::vector<Wrench>& on_body)>;
using PowerFunction = std::function<Three(double time, const std::vector<BodyMotion>&)>;

struct Settings {
  double step = 0;          // Verlet's method in fixed steps; 0: Runge-Kutta-Merson with error control [s]
  double longest_step = 0;  // of error control; 0: any [s]
  double accuracy = 1e-9;
};

/// Throws std::exception where Simbody does.
class System {
 public:
  /// No power function: nothing to integrate.
  System(const Description&, ForceFunction, PowerFunction, const Settings&);
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  /// Motions in the order of the mobilizers; they must fit the joints.
  void start(double time, const std::vector<BodyMotion>&);
  /// One step, to `until` at most; returns the time reached.
  double advance(double until);
  double time() const;
  const std::vector<BodyMotion>& motion() const;
  /// Forces have jumped: to be evaluated anew.
  void invalidate_forces();
  /// Integrals of the powers since start() [J].
  Three work() const;
  /// Of the mobilizers on the outboard bodies, at the origins of their joint frames, and of the closures on the
  /// children, at the origins of theirs.
  void find_reactions(std::vector<Wrench>& mobilizers, std::vector<Wrench>& closures) const;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

std::string version();

}  // namespace topple::engines::simbody
