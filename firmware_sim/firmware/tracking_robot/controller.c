/* controller.c: see controller.h. */
#include "controller.h"
#include "marconet_functions.h"

TrackingError tracking_error(Pose own, Pose reference)
{
    double s, c;
    sine_cosine(own.theta, &s, &c);
    const double east = reference.x - own.x, north = reference.y - own.y;
    const TrackingError x = { c * east + s * north, c * north - s * east,
                              remainder_of(reference.theta - own.theta, 2.0 * MARCONET_PI) };
    return x;
}

Velocities control(const Gains *gains, TrackingError x, Velocities inputs)
{
    double s, c;
    sine_cosine(x.x3, &s, &c);
    const double sinc = x.x3 != 0.0 ? s / x.x3 : 1.0;
    const Velocities command = { inputs.v * c + gains->k1 * x.x1,
                                 inputs.omega + gains->k2 * inputs.v * sinc * x.x2 + gains->k3 * x.x3 };
    return command;
}
