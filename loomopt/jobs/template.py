"""The commented scenes that `loomopt new` writes."""

BEATUP_TEMPLATE = """\
# A beat-up scene: crank AB = l1, connecting rod BC = l2, rocker (sley) DC = l3, frame AD = l4.
# A is the crank shaft, D the rocking shaft. Change the numbers to those of your loom, then:
#     loomopt show FILE            the scene as it was read
#     loomopt solve FILE           the best dimensions within the limits below
#
# Every number is text with its unit: "31 mm", "1.22 in", "23 deg", "600 rpm", "745 N*m", "0.62 kg*m^2".
# Decimal point, no comma; units are joined by * and /, powers are written ^2.
# Angles and speeds name their unit too: deg or rad, rpm or rad/s; Hz and 1/min are refused.

[problem]
name = "my-loom"                # letters, digits, - and _
job = "beatup"
title = "My loom"
source = ""                     # where the numbers come from: drawing, catalogue, measurement

[operation]
speed = "600 rpm"               # main shaft
M0 = "745 N*m"                  # peak resistance of the cloth, about the rocking shaft, at front dead centre

[mechanism]                     # today's machine; it must assemble, but may lie outside bounds and limits
l1 = "31 mm"
l2 = "65 mm"
l3 = "155 mm"
l4 = "167 mm"
m4e = "0 kg"                    # counterweight mass, 0 kg for none
r4e = "0 mm"                    # its distance from the rocking shaft, opposite the reed
m4 = "56.8 kg"                  # reed system; needed for gravity, centrifugal and the figure r4 only
r4 = "45 mm"                    # its centre of mass from the rocking shaft; as m4

# Effects: one table for each that counts. What has no table is not in the equations.

[effects.inertia]
J4 = "0.62 kg*m^2"              # reed system about the rocking shaft, without the counterweight

[effects.resistance]
pulse = "29.8 deg"              # crank angle through which the cloth resists, centred on front dead centre

# More effects, off: --with NAME puts one on; to keep it on, write effects instead of available. All values assumed.

[available.rocker_inertia]
J3 = "0.05 kg*m^2"            # rocker about the rocking shaft

[available.counterweight_inertia]
JS = "0.01 kg*m^2"            # counterweight about its own centre of mass

[available.rod_inertia]
m2 = "1.5 kg"                 # connecting rod
s2 = "32.5 mm"                # its centre of mass from the crank pin
JS2 = "0.0005 kg*m^2"         # about its centre of mass; needed for the exact model only
model = "lumped"              # or "exact"

[available.gravity]
tilt = "-67 deg"              # angle of the line A to D from the horizontal; negative: D lies below A
offset = "0 deg"              # angle of the reed's centre of mass from the rocker's line

[available.bearing_friction]
coulomb = "2 N*m"             # constant friction torque of the rocking shaft
viscous = "0.05 N*m*s/rad"    # friction torque per angular speed

[available.centrifugal]         # bearing load and shaking force as figures; no values of its own

# Bounds: what may change, and how far. Without a bound, or with one value, a dimension stays; with
# `free = false` it stays until --free NAME. Any other number above can be bounded by its name as well:
#     J4 = { min = "0.5 kg*m^2", max = "0.7 kg*m^2", free = false }

[bounds]
l1 = { min = "30 mm", max = "35 mm" }
l2 = { min = "60 mm", max = "85 mm" }
l3 = { min = "140 mm", max = "170 mm" }
l4 = { min = "150 mm", max = "167 mm" }
m4e = { min = "0 kg", max = "12.4 kg" }
r4e = { min = "0 mm", max = "80 mm" }

# Limits: figures to keep, at least (min), at most (max) or both.
#     swing; theta, between the dead centres' crank lines; beta, crank angle of front dead centre;
#     mu_min, least transmission angle; M3_fdc, reed torque at front dead centre; peak_torque, on the crank;
#     alpha_fdc, rocker acceleration; J4 and r4, with the counterweight; pulse_rms; and with the effect
#     centrifugal: bearing_force, shaking_force.

[limits]
swing = { min = "22.9 deg", max = "23.4 deg" }
theta = { min = "-2.2 deg", max = "2.2 deg" }
mu_min = { min = "56.5 deg" }

# Targets: balance (the default), pulse, torque, retrofit. Only these two have values of their own.
#
# [targets.torque]
# M3_tolerance = "7.45 N*m"     # reed torque allowed at front dead centre; 1 % of M0 if not given
#
# [targets.retrofit]
# weights = { l1 = 1, l3 = 5 }  # a larger weight: that dimension changes less
"""

RAPIER_TEMPLATE = """\
# A rapier scene: sley four-bar l1 l2 l3 l71, five-bar on the sley l3p l4 l5 l6, second shaft C0, one 2:1 gear.
# Origin is the rocking shaft B0; y points from the second shaft to the main shaft; angles counter-clockwise from x.
# Crank angles count from front dead centre. Change the numbers to those of your loom, then:
#     loomopt show FILE            the scene as it was read
#     loomopt solve FILE           the best dimensions within the limits below
#
# Every number is text with its unit: "31 mm", "1.22 in", "23 deg", "600 rpm", "0.35 kg".
# Decimal point, no comma; units are joined by * and /, powers are written ^2; a pure number may be a ratio "300/18".

[problem]
name = "my-rapier"
job = "rapier"
title = "My rapier drive"
source = ""

[operation]
speed = "60 rpm"  # main shaft
stroke = "850 mm"  # largest travel of the head from front dead centre
s_dwell = "6 mm"  # travel up to which the head counts as out of the shed
dwell_after = "30 deg"  # crank angle after front dead centre that it must stay out
dwell_before = "30 deg"  # and before it

[mechanism]
l1 = "76.385 mm"  # main crank
l2 = "275.705 mm"  # connecting rod
l3 = "684 mm"  # sley
l71 = "773 mm"  # main shaft A0 to rocking shaft B0
phi30 = "80.48 deg"  # sley at front dead centre
l3p = "180 mm"  # B0 to the pivot B2 on the sley
alpha = "30 deg"  # angle from the sley to B0 B2
l4 = "12 mm"  # second crank C0 C
l5 = "495.0647 mm"  # link C D
l6 = "185 mm"  # driving link B2 D, carries the gear sector
C0x = "461.0345 mm"  # second shaft
C0y = "234.2173 mm"
phi40 = "166.67588 deg"  # second crank at front dead centre
i1 = "300/18"  # gear sector to pinion
i2 = "1"  # pinion to tape wheel
wheel = "240 mm"  # tape wheel diameter

# Effects: none is on. --with NAME puts one on; to keep it on, write effects instead of available.

[available.head_inertia]
mass = "0.35 kg"  # head and moving tape; assumed

[available.tape_friction]
force = "15 N"  # tape in its guides; assumed

# Bounds: what may change, and how far. With `free = false` it stays until --free NAME; --free sley frees l1 l2 l3 l71.

[bounds]
l4 = { min = "5 mm", max = "40 mm" }
l5 = { min = "300 mm", max = "700 mm" }
l6 = { min = "120 mm", max = "260 mm" }
l3p = { min = "120 mm", max = "260 mm" }
alpha = { min = "0 deg", max = "60 deg" }
C0x = { min = "401.0345 mm", max = "521.0345 mm" }
C0y = { min = "174.2173 mm", max = "294.2173 mm" }
phi40 = { min = "146.67588 deg", max = "186.67588 deg" }
l1 = { min = "70 mm", max = "85 mm", free = false }
l2 = { min = "250 mm", max = "300 mm", free = false }
l3 = { min = "650 mm", max = "720 mm", free = false }
l71 = { min = "740 mm", max = "800 mm", free = false }

# Limits: figures to keep, at least (min), at most (max) or both:
#     mu_min, phi_stroke, peak_acceleration, peak_jerk; of the sley: swing, theta, sley_mu_min;
#     and with an effect: tape_force, peak_torque.

[limits]
mu_min = { min = "30 deg" }  # least transmission angle at D
swing = { min = "12.9 deg", max = "13.1 deg" }
theta = { min = "-6 deg", max = "-5 deg" }
sley_mu_min = { min = "60 deg" }

# Targets: stroke-dwell (the default), dwell, smooth, match. Only match has a value of its own.
#
# [targets.match]
# table = "travel.csv"          # beside this file; columns: phi1 [deg],S [mm]
"""

SHEDDING_TEMPLATE = """\
# A shedding scene: a heald frame that a cam pushes down and a return spring pulls up. Cam angles count from the rise.
# The frame is at 0 with the shed open upward (near dwell), at `travel` with it open downward (far dwell).
# Change the numbers to those of your loom, then:
#     loomopt show FILE            the scene as it was read
#     loomopt solve FILE           the least spring that keeps the roller on the cam
#
# Every number is text with its unit: "31 mm", "1.22 in", "120 deg", "600 rpm", "37.7 kg", "8 N/mm", "35 N*s/m".
# Decimal point, no comma; units are joined by * and /, powers are written ^2.

[problem]
name = "my-shedding"
job = "shedding"
title = "My heald frame on its cam"
source = ""

[operation]
speed = "600 rpm"  # cam shaft
N_min = "0 N"  # least cam force that counts as contact

[mechanism]
travel = "65.6 mm"  # of the heald frame
law = "cycloidal"  # or harmonic, modified_sine, modified_trapezoid, polynomial_345, polynomial_4567,
#                    polynomial_56789, gutman_13, freudenstein_13; table with law_table = "law.csv" (angle [deg],s [mm])
rise = "120 deg"  # the four angles make a whole turn
far_dwell = "60 deg"
return = "120 deg"
near_dwell = "60 deg"
base_radius = "50 mm"  # of the curve of the roller's centre; these five for pressure angle, curvature and profile
arm = "130 mm"  # pivot to roller
centre_distance = "140 mm"  # pivot to cam shaft
roller_radius = "20 mm"
arm_swing = "12.4 deg"  # for the whole travel
K1 = "8029.14 N/m"  # today's spring: both springs together
X0 = "80 mm"  # its elongation with the shed open upward

# Effects: one table for each that is on. --with NAME puts one on from [available], --without NAME takes one off.

[effects.weight]
G = "369.55 N"  # negative where the weight presses the roller on the cam

[effects.warp_tension]
T1 = "124.545 N"  # pull of the warp with the shed open upward
T2 = "83.03 N"  # and downward
shape = "linear"  # or step, or levels: known in the dwells only

[effects.inertia]
M = "37.68361265059934 kg"  # frame and what moves with it

[available.damping]
C = "35 N*s/m"  # viscous friction in the guides

[available.dry_friction]
F = "20 N"  # Coulomb friction in the guides; assumed

[available.coil]
wire = "6 mm"  # one spring: wire diameter
diameter = "45 mm"  # mean coil diameter
turns = "8"  # active turns
initial_tension = "100 N"  # force that parts the turns
springs = "2"  # how many share K1
shear_modulus = "77.2 GPa"  # its steel
elasticity = "203.4 GPa"
density = "7850 kg/m^3"
strength = "1974 MPa"  # tensile strength of 1 mm wire; it falls as wire^-strength_exponent
strength_exponent = "0.108"
shear_share = "0.5"  # share of the strength the body may carry
bending_share = "0.75"  # and the hooks
spring_length = "400 mm"  # space inside the hooks, shed open downward
surge_ratio = "13"  # least surge frequency over that of the cam

# Bounds: what may change, and how far. With `free = false` it stays until --free NAME; --free rise frees the angles.

[bounds]
K1 = { min = "0 N/m", max = "1000 kN/m" }
X0 = { min = "0 mm", max = "80 mm" }  # space for the preload
rise = { min = "90 deg", max = "150 deg", free = false }
far_dwell = { min = "50 deg", max = "90 deg", free = false }
return = { min = "90 deg", max = "150 deg", free = false }
near_dwell = { min = "50 deg", max = "90 deg", free = false }
wire = { min = "2 mm", max = "9.5 mm" }  # these wait for the effect coil
diameter = { min = "10 mm", max = "80 mm" }
turns = { min = "3", max = "40" }
initial_tension = { min = "0 N", max = "1000 N" }

# Limits: figures to keep, at least (min), at most (max) or both:
#     contact_max, spring_force_max, spring_stretch, law_acceleration, pressure_angle_max, curvature_min, curvature_max;
#     and with the effect coil: shear_stress, spring_mass.

[limits]
pressure_angle_max = { max = "45 deg" }

# Targets: stiffness (the default), law, force, speed. Only law has values of its own.

[targets.law]
intervals = 16  # of the spline
symmetric = false  # true asks s(u) + s(1 - u) = 1
acceleration = 6.283185307179586  # largest |s''|; 2 pi is the cycloid's own
"""
