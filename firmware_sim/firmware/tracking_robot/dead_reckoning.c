/* dead_reckoning.c: see dead_reckoning.h. */
#include "dead_reckoning.h"
#include "marconet_functions.h"

static const double STRAIGHT = 1e-8;    /* [rad]; below, sinc is 1 to 1e-17 */

static Pose after(const DeadReckoning *place, double left, double right)
{
    const double way = place->radius * (left + right) / 2.0;
    const double half = place->radius * (right - left) / place->track / 2.0;
    double s, c;
    sine_cosine(half, &s, &c);
    const double chord = way * (magnitude(half) > STRAIGHT ? s / half : 1.0);
    sine_cosine(place->pose.theta + half, &s, &c);
    const Pose pose = { place->pose.x + chord * c, place->pose.y + chord * s, place->pose.theta + 2.0 * half };
    return pose;
}

void dead_reckoning_init(DeadReckoning *place, double radius, double track, Pose start)
{
    const DeadReckoning made = { radius, track, start, false, 0, 0.0, 0.0, 0.0, 0.0 };
    *place = made;
}

void dead_reckoning_read(DeadReckoning *place, int64_t at_ns, double left, double right)
{
    if (place->has_reading) {
        const int64_t elapsed_ns = at_ns - place->at_ns;
        if (elapsed_ns <= 0) {
            return;
        }
        const double turned_left = left - place->left, turned_right = right - place->right;
        place->pose = after(place, turned_left, turned_right);
        place->left_speed = turned_left / (double)elapsed_ns;
        place->right_speed = turned_right / (double)elapsed_ns;
    }
    place->has_reading = true;
    place->at_ns = at_ns;
    place->left = left;
    place->right = right;
}

Pose dead_reckoning_at(const DeadReckoning *place, int64_t at_ns)
{
    if (!place->has_reading) {
        return place->pose;
    }
    const double since_ns = (double)(at_ns - place->at_ns);
    return after(place, place->left_speed * since_ns, place->right_speed * since_ns);
}
