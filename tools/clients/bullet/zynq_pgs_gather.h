// Bullet's islands as the bodies and collisions of one step of the board. ZynqPgsSolver uses it.
#pragma once

#include <btBulletDynamicsCommon.h>
#include <zynq_pgs.h>

#include <array>
#include <cstdint>
#include <map>
#include <vector>

class ZynqPgsGather {
public:
    // A body as the board takes it.
    struct Body {
        float position[3], orientation[4];
        float linearVelocity[3], angularVelocity[3];
        uint32_t shape;
    };
    // The speeds of a body that take it out of deep penetration within a time step.
    struct Push {
        float linear[3], angular[3];
    };
    ZynqPgsGather(int pointsPerCollision, float deepShare)
        : m_pointsPerCollision(pointsPerCollision), m_deepShare(deepShare) {}

    // Forgets the step, but not the shapes.
    void clear();
    // Takes an island, or some.
    void take(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds, int numManifolds);
    // Makes collisions and bodies of everything taken.
    void gather(const btContactSolverInfo &info);
    // Gives every body taken its velocity: the one in bodies(), or by its forces if it is in no collision.
    // Moves the bodies by their pushes, if preparePushes was called.
    void write(const btContactSolverInfo &info);
    // Puts the collisions in reverse order.
    void reverse();
    // Makes impulses() from the impulses in Bullet's points, times `factor`; without friction where Bullet's
    // tangents are in the points. Before the friction goes into the collisions' counts.
    void loadImpulses(float factor, bool withFriction);
    // Stores impulses() in Bullet's points.
    void storeImpulses();
    // Makes places() from the places that the last storePlaces has left in Bullet's points.
    void loadPlaces();
    // Leaves in each of Bullet's points its place in this step.
    void storePlaces();
    // Makes every point a new one, as where the library has lost the last step.
    void forgetPlaces() { m_hasPlaces = false; }
    // Makes the distances of collisions() those of the second step: deep points push, others resist and may
    // close a gap. The pushes, one for each of bodies(), are 0 before that step.
    std::vector<Push> &preparePushes(const btContactSolverInfo &info);
    // A property of a contact of the manifold that no board has, in words; null if there is none.
    static const char *property(const btPersistentManifold &manifold, const btContactSolverInfo &info);

    // The bodies and manifolds taken.
    std::vector<btCollisionObject *> &takenBodies() { return m_takenBodies; }
    std::vector<btPersistentManifold *> &takenManifolds() { return m_takenManifolds; }

    // What goes to the board. A body that no collision names does not.
    std::vector<Body> &bodies() { return m_bodies; }
    std::vector<zpgs_collision> &collisions() { return m_collisions; }
    const std::vector<float> &frictions() const { return m_frictions; }  // parallel to collisions()
    std::vector<zpgs_impulses> &impulses() { return m_impulses; }        // parallel to collisions()
    const std::vector<zpgs_place> &places() const { return m_places; }   // parallel to collisions()
    // True if a point is so deep that its push is one of the pose, not of the velocity.
    bool isDeep() const { return m_isDeep; }
    // True if a kinematic body in a collision moves.
    bool hasKinematic() const { return m_hasKinematic; }
    const std::vector<zpgs_shape> &shapes() const { return m_shapes; }
    // Forgets the shapes, as after the board has refused them.
    void clearShapes();

private:
    void addManifold(btPersistentManifold *manifold, const btContactSolverInfo &info);
    size_t collisionOf(btPersistentManifold *manifold, const btManifoldPoint &point, size_t first,
                       const btContactSolverInfo &info);
    uint32_t bodyOf(btCollisionObject *object, const btContactSolverInfo &info);
    uint32_t shapeOf(btScalar inverseMass, const btVector3 &inverseInertia);
    void clearGathered();
    uint64_t placeOf(const btManifoldPoint &point) const;
    // Whether the points are of two collisions of the last step. As a collision has one place, they share none.
    bool wereApart(const btManifoldPoint &one, const btManifoldPoint &other) const;

    // Bullet's points of a collision: element i is that of contact i; the rest is null.
    using Points = std::array<btManifoldPoint *, ZPGS_CONTACT_POINTS>;

    const int m_pointsPerCollision;
    const float m_deepShare;
    std::vector<btCollisionObject *> m_takenBodies;
    std::vector<btPersistentManifold *> m_takenManifolds;

    std::vector<Body> m_bodies;
    std::vector<btCollisionObject *> m_objects;  // parallel to m_bodies
    std::vector<int> m_bodyOfObject;             // by the object's index in its world; -1 is none
    std::vector<zpgs_collision> m_collisions;
    std::vector<Points> m_points;
    std::vector<float> m_frictions;
    std::vector<zpgs_impulses> m_impulses;
    std::vector<zpgs_place> m_places;
    bool m_hasPlaces = false;
    uint64_t m_placesStored = 0;
    std::vector<Push> m_pushes;  // parallel to m_bodies, or empty
    bool m_hasKinematic = false;
    bool m_isDeep = false;

    // The table stays from step to step, so that the board seldom gets a new one.
    std::vector<zpgs_shape> m_shapes;
    std::map<std::array<float, 4>, uint32_t> m_shapeIndices;
    bool m_tooManyShapes = false;
    // Whether the table was empty when the gathering began: it may then grow beyond SHAPES.
    bool m_fresh = true;
};
