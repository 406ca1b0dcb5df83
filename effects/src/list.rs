//! The list of the catalogue. Everything that names all kinds is made of it.
//! `effects` act on efforts, `servo` on set points; `outside` are laws that effects are held against.

/// Hands the list to a macro: of each kind its file, which is its public name, its type, and its number. A number is never
/// given twice. It orders kinds where a climb goes through them: what every used robot has comes first.
macro_rules! catalogue {
    ($take:ident) => {
        $take! {
            effects {
                /// −b q̇.
                viscous_friction ViscousFriction 0,
                /// −f sign q̇, sticks at rest.
                coulomb_friction CoulombFriction 1,
                /// Dry friction that rises towards standstill.
                stribeck_friction StribeckFriction 10,
                /// Dry friction in proportion to the effort.
                load_dependent_friction LoadDependentFriction 11,
                /// Bristles: elastic before they slide.
                presliding_friction PreslidingFriction 12,
                /// Dry friction that decays as the drive warms up.
                thermal_drift ThermalDrift 13,
                /// A rigid body more at the flange.
                payload Payload 6,
                /// A link's inertial parameters differ from the URDF.
                link_inertia_error LinkInertiaError 2,
                /// Rotor inertia behind the gear.
                armature Armature 3,
                /// The base is tilted.
                gravity_misalignment GravityMisalignment 8,
                /// Effort delivered = gain · effort logged.
                torque_gain_error TorqueGainError 5,
                /// Constant effort offset.
                torque_bias TorqueBias 4,
                /// Effort acts later than logged.
                actuation_delay ActuationDelay 14,
                /// First-order effort response.
                actuator_lag ActuatorLag 15,
                /// Effort clipped.
                torque_saturation TorqueSaturation 16,
                /// Effort that is periodic in position.
                torque_ripple TorqueRipple 17,
                /// Spring between motor and link.
                joint_elasticity JointElasticity 18,
                /// Play between motor and link.
                backlash Backlash 19,
                /// Spring across the joint.
                parallel_spring ParallelSpring 7,
                /// The encoder's zero is off.
                joint_zero_offset JointZeroOffset 20,
                /// An outside force for some of the time.
                external_contact ExternalContact 21,
                /// Friction or inertia on a sum of two joint speeds.
                joint_coupling JointCoupling 9,
            }
            servo {
                /// A servo's proportional gain differs from the one given.
                servo_gain_error ServoGainError 27,
                /// A servo's derivative gain or back-EMF differs from the one given.
                servo_damping_error ServoDampingError 28,
                /// The drive does not turn faster.
                speed_limit SpeedLimit 29,
                /// A servo does nothing within a small error.
                dead_band DeadBand 30,
            }
            outside {
                /// Outside the catalogue: drag of a medium on a link.
                link_drag LinkDrag 22,
                /// Outside the catalogue: drag in a joint, of a power of its speed.
                joint_drag JointDrag 23,
                /// Outside the catalogue: a mass that swings on the last link.
                swing Swing 24,
                /// Outside the catalogue: dry friction at one place of a joint's travel.
                rub Rub 25,
                /// Outside the catalogue: torque at one place of a joint's travel.
                catch Catch 26,
                /// Outside the catalogue: a spring that stiffens along a joint's travel.
                nonlinear_spring NonlinearSpring 31,
            }
        }
    };
}

pub(crate) use catalogue;
