"""Compiled numerics of the boom's mechanics, and their notation.

Frames and signs
    Model plane: x forward, y up, angles anticlockwise, SI units, radians. The frame is fixed to the unloaded base
    (`base_link`). With an inclined base, gravity is rotated instead.

State vector at a cut of the chain
    Z = [e, f]. e = (x, y, theta) is position (m) and orientation (rad). f = (qx, qy, M) is force (N) and torque (N m) that
    the inboard side exerts on the outboard side. f lists forces first, so that it is conjugate to e. At an input end f is
    positive along the axes. A massless hinge therefore passes it unchanged (Zhang et al. 2016, section 3.1).

Transfer in Newton form
    An element has its own coordinates z (bending, joint angle, pin forces). Its equations stay nonlinear. Only increments
    about the present iterate are transferred. With the outboard side condensed to

        f_O = S de_O + p                      (Riccati transformation)

    the equations of an element, written as the gradient of its work, are

        f_I  = g_e(e, z) + H_ee de + H_ez dz ,     0 = g_z(e, z) + H_ze de + H_zz dz ,

    with S and p already pulled back through e_O(e, z). Condensing dz gives S_I = H_ee - H_ez H_zz^-1 H_ze and
    p_I = g_e - H_ez H_zz^-1 g_z. This is one small solve per element, without products of large and small numbers. With
    transfer-matrix blocks U it is the known S_I = -(U_ff - S U_ef)^-1 (U_fe - S U_ee), without forming U.

Carried columns
    A closed loop contains a cylinder whose barrel pin C lies further inboard. From the loop's joint to C, e is extended by
    the increments of C (dx_C, dy_C), or by the force N of cylinder 1 and the turn of an elastic base. S and p grow accordingly.

Time
    Every mass centre and quadrature point has its own history. For each scalar x, an integrator gives acceleration
    a = A (x - x_hat) and velocity v = C x + D at the new time (see `boom_twin.kernels.integrators`). A = C = 0 gives
    statics. A = -omega^2 with x_hat = x gives harmonic vibration.

Symbols
    S, p      condensed tangent and force of the outboard side
    A, C, D   coefficients of the integrator
    c, s      cos and sin of an orientation
    h         step, s
    N         force between barrel and rod, tension positive
    l, l_ref  pin-to-pin length, drive length

Sources
    [Z] Z.W. Zhang, Y.X. Wu, J.G. Liu, W. Ren, M.H. Cao: Research on the rigid-flexible multibody dynamics of concrete placing
        boom, 2016.
    [R] W. Ren, Y. Wu, Z. Zhang, W. Shi: A numerical method of large-scale concrete displacing boom dynamic and experimental
        validation, 2014, doi 10.1155/2014/943847.
    [B] Riccati form for tree systems: doi 10.1007/s11044-019-09711-2.
    [AB] M. Arnold, O. Bruels: Convergence of the generalized-alpha scheme for constrained mechanical systems, Multibody
        System Dynamics 18 (2007).
"""
