// The corrected model of a robot for C++11 and later. All physics is in robot.c, which is compiled as C and linked.
#ifndef GAPSCOPE_ROBOT_HPP
#define GAPSCOPE_ROBOT_HPP

#ifdef GAPSCOPE_HEADER_ONLY
#include "robot.c"
#else
#define GAPSCOPE_HEADER_ONLY
#include "robot.c"
#undef GAPSCOPE_HEADER_ONLY
#endif
#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace gapscope {

// A number for each joint, in the order of `name`.
using Vector = std::array<double, GAPSCOPE_JOINTS>;

inline constexpr std::size_t joints() { return GAPSCOPE_JOINTS; }
// Length of a step, s.
inline constexpr double dt() { return GAPSCOPE_DT; }
inline const char *name(std::size_t joint) { return gapscope_joints[joint]; }

// The weights of a residual network, from residual.bin.
class Residual {
public:
    explicit Residual(const std::string &file) : network()
    {
        switch (gapscope_residual_load(&network, file.c_str())) {
        case 0: return;
        case 1: throw std::runtime_error("cannot read " + file);
        case 2: throw std::runtime_error(file + " has no residual for this robot and step; export it anew");
        default: throw std::bad_alloc();
        }
    }
    ~Residual() { gapscope_residual_free(&network); }
    Residual(const Residual &) = delete;
    Residual &operator=(const Residual &) = delete;

private:
    friend class Robot;
    gapscope_residual network;
};

// The robot in a moment. A copy is another robot in the same moment.
class Robot {
public:
    // Measured positions and speeds, rad and rad/s (m and m/s).
    Robot(const Vector &q, const Vector &v) { start(q, v); }
    void start(const Vector &q, const Vector &v) { gapscope_start(&state, q.data(), v.data()); }
    // One step of `dt` under the efforts, N m (N), held over it.
    void step(const Vector &tau) { gapscope_step(&state, tau.data()); }
    // The same with a residual. It keeps what it works with in the residual: one thread at a time.
    void step(const Vector &tau, const Residual &residual) { gapscope_hybrid_step(&state, &residual.network, tau.data()); }
    Vector position() const { return of(state.q); }
    Vector velocity() const { return of(state.v); }
    // Since the start, s.
    double time() const { return state.time; }

private:
    static Vector of(const double *values)
    {
        Vector out;
        for (std::size_t j = 0; j < out.size(); j++) out[j] = values[j];
        return out;
    }
    gapscope_state state;
};

// Efforts that a motion takes, N m (N); of a joint that stands the least that does.
inline Vector inverse_dynamics(const Vector &q, const Vector &v, const Vector &a)
{
    Vector tau;
    gapscope_inverse_dynamics(q.data(), v.data(), a.data(), tau.data());
    return tau;
}

// Accelerations under efforts that act now, rad/s^2 (m/s^2).
inline Vector forward_dynamics(const Vector &q, const Vector &v, const Vector &tau)
{
    Vector a;
    gapscope_forward_dynamics(q.data(), v.data(), tau.data(), a.data());
    return a;
}

} // namespace gapscope

#endif
