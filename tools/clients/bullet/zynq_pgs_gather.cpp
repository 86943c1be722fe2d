#include "zynq_pgs_gather.h"

#include <algorithm>

namespace {

// Shapes of several steps: at most the entries of the board's table. The shapes of one step may be more.
const size_t SHAPES = 64;
// A collision has one normal, a manifold has one for each point. Points share a collision if their normals
// differ by less than 2.6 degrees.
const btScalar SAME_NORMAL = btScalar(0.999);
const uint32_t STATIC_SHAPE = 0;
// The numbers of storePlaces in a point, which begin again behind the last.
const uint64_t STORES = uint64_t(1) << 30;
static_assert(sizeof(void *) == 8, "a place takes 64 bits of the user data of a point");

void store(float *to, const btVector3 &vector) {
    for (int i = 0; i < 3; i++) to[i] = float(vector[i]);
}

btVector3 load(const float *from) { return btVector3(from[0], from[1], from[2]); }

btRigidBody *movable(btCollisionObject *object) {
    btRigidBody *body = btRigidBody::upcast(object);
    return body && body->getInvMass() > 0 && !body->isStaticOrKinematicObject() ? body : nullptr;
}

// The body whose velocity counts in a contact. Like Bullet, this ignores the velocity of a static body.
const btRigidBody *moving(const btCollisionObject *object) {
    const btRigidBody *body = btRigidBody::upcast(object);
    return body && (body->getInvMass() > 0 || body->isKinematicObject()) ? body : nullptr;
}

// Velocities with this step's forces, as Bullet's solver has them.
void velocitiesWithForces(const btRigidBody &body, const btContactSolverInfo &info, btVector3 &linear,
                          btVector3 &angular) {
    const btScalar timeStep = info.m_timeStep;
    linear = body.getLinearVelocity() + body.getTotalForce() * (body.getInvMass() * timeStep);
    btVector3 change = body.getInvInertiaTensorWorld() * body.getTotalTorque() * timeStep;
    const int flags = body.getFlags();
    if (flags & BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT) {
        const btVector3 force = body.computeGyroscopicForceExplicit(info.m_maxGyroscopicForce);
        change -= body.getInvInertiaTensorWorld() * force * timeStep;
    }
    if (flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD)
        change += body.computeGyroscopicImpulseImplicit_World(timeStep);
    if (flags & BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY)
        change += body.computeGyroscopicImpulseImplicit_Body(timeStep);
    angular = body.getAngularVelocity() + change;
}

btScalar distanceOf(const btManifoldPoint &point, const btContactSolverInfo &info) {
    return point.getDistance() + info.m_linearSlop;
}

// Bullet takes bodies out of this penetration by their poses, without a velocity.
bool isDeepPoint(const btManifoldPoint &point, const btContactSolverInfo &info) {
    const btScalar distance = distanceOf(point, info);
    return info.m_splitImpulse && distance < 0 && distance <= info.m_splitImpulsePenetrationThreshold;
}

// The speed that removes the share (ERP) of a point's penetration in a step.
btScalar recovery(const btManifoldPoint &point, btScalar distance, const btContactSolverInfo &info) {
    const bool ownErp = point.m_contactPointFlags & BT_CONTACT_FLAG_HAS_CONTACT_ERP;
    return btMax(-distance, btScalar(0)) * (ownErp ? point.m_contactERP : info.m_erp2) / info.m_timeStep;
}

// The speed at which a point may close, m/s, which travels as its distance. Below 0 the bodies must part.
// - A gap closes within the step at most, so that a point ahead of the contact does nothing too early.
// - Penetration goes by its share (ERP) in a step, as in Bullet. That of a deep point is the second step's, and
//   the point has `deepShare` of the speed that one at the threshold has.
// - A bounce takes the place of that push where it is faster. Bullet adds the two, and a ball then rises
//   higher than its restitution says.
float closingSpeed(const btManifoldPoint &point, const btCollisionObject *a, const btCollisionObject *b,
                   const btContactSolverInfo &info, float deepShare) {
    auto velocity = [&point](const btCollisionObject *object) {
        const btRigidBody *body = moving(object);
        if (!body) return btVector3(0, 0, 0);
        const btVector3 &centre = object->getWorldTransform().getOrigin();
        return body->getVelocityInLocalPoint(point.getPositionWorldOnB() - centre);
    };
    const btScalar parting = point.m_normalWorldOnB.dot(velocity(a) - velocity(b));
    const bool bounces = parting < -info.m_restitutionVelocityThreshold;
    const btScalar bounce = bounces ? -parting * point.m_combinedRestitution : btScalar(0);
    const btScalar distance = distanceOf(point, info);
    if (distance > 0) return float(distance / info.m_timeStep - bounce);
    const btScalar push = isDeepPoint(point, info)
                              ? deepShare * recovery(point, info.m_splitImpulsePenetrationThreshold, info)
                              : recovery(point, distance, info);
    return -float(btMax(push, bounce));
}

// The property of a point that no board has, in words; null if it has none.
const char *propertyOf(const btManifoldPoint &point, const btContactSolverInfo &info) {
    const int flags = point.m_contactPointFlags;
    if (point.m_combinedRollingFriction > 0) return "rolling friction";
    if (point.m_combinedSpinningFriction > 0) return "spinning friction";
    if (flags & BT_CONTACT_FLAG_FRICTION_ANCHOR) return "friction anchors";
    if ((flags & BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED) &&
        (info.m_solverMode & SOLVER_ENABLE_FRICTION_DIRECTION_CACHING) &&
        (point.m_contactMotion1 != 0 || point.m_contactMotion2 != 0))
        return "surface motion";
    // CFM or ERP of a point's own take the place of stiffness and damping.
    const bool own = flags & (BT_CONTACT_FLAG_HAS_CONTACT_CFM | BT_CONTACT_FLAG_HAS_CONTACT_ERP);
    if (!own && (flags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING)) return "contact stiffness and damping";
    const bool ownCfm = flags & BT_CONTACT_FLAG_HAS_CONTACT_CFM;
    return (ownCfm ? point.m_contactCFM : info.m_globalCfm) > 0 ? "soft contacts (CFM)" : nullptr;
}

// Whether Bullet's solver has rows for the contacts of the manifold.
bool responds(const btPersistentManifold &manifold) {
    auto *a = const_cast<btCollisionObject *>(manifold.getBody0());
    auto *b = const_cast<btCollisionObject *>(manifold.getBody1());
    return a->hasContactResponse() && b->hasContactResponse() && (movable(a) || movable(b));
}

}  // namespace

void ZynqPgsGather::clearGathered() {
    for (const btCollisionObject *object : m_objects)
        m_bodyOfObject[size_t(object->getWorldArrayIndex())] = -1;
    m_objects.clear();
    m_bodies.clear();
    m_collisions.clear();
    m_points.clear();
    m_frictions.clear();
    m_impulses.clear();
    m_pushes.clear();
    m_hasKinematic = false;
    m_isDeep = false;
}

void ZynqPgsGather::clear() {
    clearGathered();
    m_takenBodies.clear();
    m_takenManifolds.clear();
}

void ZynqPgsGather::clearShapes() {
    m_shapes.clear();
    m_shapeIndices.clear();
}

void ZynqPgsGather::take(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds,
                         int numManifolds) {
    m_takenBodies.insert(m_takenBodies.end(), bodies, bodies + numBodies);
    m_takenManifolds.insert(m_takenManifolds.end(), manifolds, manifolds + numManifolds);
}

void ZynqPgsGather::gather(const btContactSolverInfo &info) {
    m_fresh = m_shapes.empty();
    m_tooManyShapes = false;
    if (m_fresh) shapeOf(0, btVector3(0, 0, 0));  // STATIC_SHAPE
    for (btPersistentManifold *manifold : m_takenManifolds) addManifold(manifold, info);
    if (!m_tooManyShapes) return;

    // Shapes of bodies that are gone or asleep may fill the table: again with the shapes of this step alone.
    clearShapes();
    clearGathered();
    gather(info);
}

const char *ZynqPgsGather::property(const btPersistentManifold &manifold, const btContactSolverInfo &info) {
    const int count = manifold.getNumContacts();
    if (count == 0 || !responds(manifold)) return nullptr;
    if (manifold.getBody0()->hasAnisotropicFriction() || manifold.getBody1()->hasAnisotropicFriction())
        return "anisotropic friction";
    for (int i = 0; i < count; i++)
        if (const char *found = propertyOf(manifold.getContactPoint(i), info)) return found;
    return nullptr;
}

std::vector<ZynqPgsGather::Push> &ZynqPgsGather::preparePushes(const btContactSolverInfo &info) {
    for (size_t at = 0; at < m_collisions.size(); at++)
        for (size_t i = 0; i < m_points[at].size() && m_points[at][i]; i++) {
            const btManifoldPoint &point = *m_points[at][i];
            const btScalar distance = distanceOf(point, info);
            const btScalar gap = btMax(distance, btScalar(0)) / info.m_timeStep;
            const bool deep = isDeepPoint(point, info);
            m_collisions[at].contacts[i].distance = float(deep ? -recovery(point, distance, info) : gap);
        }
    m_pushes.assign(m_bodies.size(), Push());
    return m_pushes;
}

void ZynqPgsGather::reverse() {
    std::reverse(m_collisions.begin(), m_collisions.end());
    std::reverse(m_points.begin(), m_points.end());
    std::reverse(m_frictions.begin(), m_frictions.end());
}

void ZynqPgsGather::addManifold(btPersistentManifold *manifold, const btContactSolverInfo &info) {
    auto *a = const_cast<btCollisionObject *>(manifold->getBody0());
    auto *b = const_cast<btCollisionObject *>(manifold->getBody1());
    if (!responds(*manifold)) return;
    const int count = manifold->getNumContacts();
    if (count == 0) return;

    // The nearest point of the first one follows it. So two points that share a collision lie at one edge of
    // a face, and the friction of the two collisions acts at opposite edges. With places it is the one that
    // shared the first one's collision in the last step, or the nearest new one.
    int order[MANIFOLD_CACHE_SIZE];
    for (int i = 0; i < count; i++) order[i] = i;
    std::stable_partition(order, order + count,
                          [&](int i) { return placeOf(manifold->getContactPoint(i)) != 0; });
    if (m_pointsPerCollision == 2 && count > 2) {
        auto away = [this, manifold, &order](int i) {
            const btManifoldPoint &first = manifold->getContactPoint(order[0]);
            const btManifoldPoint &point = manifold->getContactPoint(i);
            const btScalar distance = point.getPositionWorldOnB().distance2(first.getPositionWorldOnB());
            if (wereApart(first, point)) return distance + 1000;
            return placeOf(point) ? btScalar(-1) : distance;
        };
        std::swap(order[1], *std::min_element(order + 1, order + count,
                                              [&away](int i, int j) { return away(i) < away(j); }));
    }

    const size_t first = m_collisions.size();
    for (int i = 0; i < count; i++) {
        btManifoldPoint &point = manifold->getContactPoint(order[i]);
        const size_t at = collisionOf(manifold, point, first, info);
        zpgs_collision &collision = m_collisions[at];
        zpgs_contact &contact = collision.contacts[collision.count];
        store(contact.point, point.getPositionWorldOnB());
        contact.distance = closingSpeed(point, a, b, info, m_deepShare);
        m_isDeep |= isDeepPoint(point, info);
        m_points[at][collision.count] = &point;
        collision.count++;
    }
}

// The collision of this manifold that takes the point: a known one from number `first` on, or a new one.
size_t ZynqPgsGather::collisionOf(btPersistentManifold *manifold, const btManifoldPoint &point, size_t first,
                                  const btContactSolverInfo &info) {
    const int points = std::max(1, std::min(m_pointsPerCollision, ZPGS_CONTACT_POINTS));
    const uint32_t room = uint32_t(points);
    const float friction = float(btMax(point.m_combinedFriction, btScalar(0)));
    for (size_t at = first; at < m_collisions.size(); at++) {
        const zpgs_collision &collision = m_collisions[at];
        auto apart = [&](const btManifoldPoint *other) { return other && wereApart(*other, point); };
        if (collision.count < room && m_frictions[at] == friction &&
            std::none_of(m_points[at].begin(), m_points[at].end(), apart) &&
            load(collision.normal).dot(point.m_normalWorldOnB) > SAME_NORMAL)
            return at;
    }
    zpgs_collision collision = {};
    collision.body_a = bodyOf(const_cast<btCollisionObject *>(manifold->getBody0()), info);
    collision.body_b = bodyOf(const_cast<btCollisionObject *>(manifold->getBody1()), info);
    store(collision.normal, point.m_normalWorldOnB);
    m_collisions.push_back(collision);
    m_points.push_back(Points());
    m_frictions.push_back(friction);
    return m_collisions.size() - 1;
}

uint32_t ZynqPgsGather::bodyOf(btCollisionObject *object, const btContactSolverInfo &info) {
    // Bullet's companion id would do, but its own solver leaves old ones behind.
    const size_t place = size_t(object->getWorldArrayIndex());
    if (place >= m_bodyOfObject.size()) m_bodyOfObject.resize(place + 1, -1);
    if (m_bodyOfObject[place] >= 0) return uint32_t(m_bodyOfObject[place]);
    m_bodyOfObject[place] = int(m_bodies.size());

    Body body = {};
    store(body.position, object->getWorldTransform().getOrigin());
    body.orientation[3] = 1.0f;
    body.shape = STATIC_SHAPE;
    if (const btRigidBody *rigid = movable(object)) {
        btVector3 linear, angular;
        velocitiesWithForces(*rigid, info, linear, angular);
        store(body.linearVelocity, linear);
        store(body.angularVelocity, angular);
        btVector3 inverseInertia = rigid->getInvInertiaDiagLocal();
        if (rigid->getAngularFactor().isZero()) inverseInertia.setZero();
        body.shape = shapeOf(rigid->getInvMass(), inverseInertia);
        // Without integration the orientation only turns the inertia, and a sphere's needs no turn.
        if (inverseInertia[0] != inverseInertia[1] || inverseInertia[0] != inverseInertia[2]) {
            const btQuaternion turn = object->getWorldTransform().getRotation();
            for (int i = 0; i < 4; i++) body.orientation[i] = float(turn[i]);
        }
    } else if (const btRigidBody *carried = moving(object)) {
        store(body.linearVelocity, carried->getLinearVelocity());
        store(body.angularVelocity, carried->getAngularVelocity());
        m_hasKinematic |= !carried->getLinearVelocity().isZero() || !carried->getAngularVelocity().isZero();
    }
    m_bodies.push_back(body);
    m_objects.push_back(object);
    return uint32_t(m_bodies.size() - 1);
}

uint32_t ZynqPgsGather::shapeOf(btScalar inverseMass, const btVector3 &inverseInertia) {
    zpgs_shape shape = {float(inverseMass), {}};
    store(shape.inverse_inertia, inverseInertia);
    const std::array<float, 4> key = {shape.inverse_mass, shape.inverse_inertia[0], shape.inverse_inertia[1],
                                      shape.inverse_inertia[2]};
    const auto found = m_shapeIndices.find(key);
    if (found != m_shapeIndices.end()) return found->second;
    if (m_shapes.size() >= SHAPES && !m_fresh) {
        m_tooManyShapes = true;
        return STATIC_SHAPE;
    }
    m_shapes.push_back(shape);
    return m_shapeIndices[key] = uint32_t(m_shapes.size() - 1);
}

void ZynqPgsGather::write(const btContactSolverInfo &info) {
    auto set = [](btRigidBody *body, const btVector3 &linear, const btVector3 &angular) {
        // The board knows no locked axes.
        body->setLinearVelocity(linear * body->getLinearFactor());
        body->setAngularVelocity(angular * body->getAngularFactor());
    };
    for (size_t i = 0; i < m_bodies.size(); i++)
        if (btRigidBody *body = movable(m_objects[i]))
            set(body, load(m_bodies[i].linearVelocity), load(m_bodies[i].angularVelocity));
    for (size_t i = 0; i < m_pushes.size(); i++)
        if (btRigidBody *body = movable(m_objects[i])) {
            const btVector3 linear = load(m_pushes[i].linear) * body->getLinearFactor();
            const btVector3 turn = load(m_pushes[i].angular) * body->getAngularFactor();
            if (linear.isZero() && turn.isZero()) continue;
            btTransform moved;
            btTransformUtil::integrateTransform(body->getWorldTransform(), linear,
                                                turn * info.m_splitImpulseTurnErp, info.m_timeStep, moved);
            body->setWorldTransform(moved);
        }
    for (btCollisionObject *object : m_takenBodies) {
        const size_t place = size_t(object->getWorldArrayIndex());
        if (place < m_bodyOfObject.size() && m_bodyOfObject[place] >= 0) continue;
        btRigidBody *body = movable(object);
        if (!body) continue;
        // A body in no collision has only its forces.
        btVector3 linear, angular;
        velocitiesWithForces(*body, info, linear, angular);
        set(body, linear, angular);
    }
}

// The tangential impulses of a collision are in m_appliedImpulseLateral1 and 2 of its points, an equal share
// in each and along the board's tangents. A point that goes takes its share along, and one that joins another
// collision brings it there. The tangents turn with the normal; where they jump, the passes put right what one
// step begins with.
void ZynqPgsGather::loadImpulses(float factor, bool withFriction) {
    m_impulses.assign(m_collisions.size(), zpgs_impulses());
    for (size_t at = 0; at < m_collisions.size(); at++) {
        zpgs_impulses &impulses = m_impulses[at];
        for (uint32_t i = 0; i < m_collisions[at].count; i++) {
            const btManifoldPoint &point = *m_points[at][i];
            impulses.normal[i] = factor * float(point.m_appliedImpulse);
            if (!withFriction) continue;
            impulses.friction[0] += factor * float(point.m_appliedImpulseLateral1);
            impulses.friction[1] += factor * float(point.m_appliedImpulseLateral2);
        }
    }
}

void ZynqPgsGather::storeImpulses() {
    for (size_t at = 0; at < m_points.size(); at++) {
        const Points &points = m_points[at];
        const auto last = std::find(points.begin(), points.end(), nullptr);
        const btScalar share = btScalar(1) / btScalar(last - points.begin());
        for (auto point = points.begin(); point != last; ++point) {
            (*point)->m_appliedImpulse = m_impulses[at].normal[point - points.begin()];
            (*point)->m_appliedImpulseLateral1 = m_impulses[at].friction[0] * share;
            (*point)->m_appliedImpulseLateral2 = m_impulses[at].friction[1] * share;
        }
    }
}

// A place is in m_userPersistentData of its point: the number of storePlaces in 30 bits, of the collision in
// 32, of the point in 2, from 1 on. Bullet keeps it with the point, and a new point has 0. Points of an island
// that slept, or was Bullet's, have that of an earlier step.
uint64_t ZynqPgsGather::placeOf(const btManifoldPoint &point) const {
    const uint64_t kept = reinterpret_cast<uintptr_t>(point.m_userPersistentData);
    return m_hasPlaces && kept != 0 && (kept - 1) >> 34 == m_placesStored % STORES ? kept : 0;
}

bool ZynqPgsGather::wereApart(const btManifoldPoint &one, const btManifoldPoint &other) const {
    const uint64_t first = placeOf(one), second = placeOf(other);
    return first && second && (first - 1) >> 2 != (second - 1) >> 2;
}

void ZynqPgsGather::loadPlaces() {
    const uint8_t none = ZPGS_NEW_POINT;
    m_places.assign(m_collisions.size(), {ZPGS_NEW_COLLISION, {none, none, none, none}});
    for (size_t at = 0; at < m_collisions.size(); at++)
        for (uint32_t i = 0; i < m_collisions[at].count; i++) {
            const uint64_t kept = placeOf(*m_points[at][i]);
            if (kept == 0) continue;
            m_places[at].collision = uint32_t((kept - 1) >> 2);
            m_places[at].points[i] = uint8_t((kept - 1) & 3);
        }
}

void ZynqPgsGather::storePlaces() {
    m_hasPlaces = true;
    const uint64_t step = ++m_placesStored % STORES;
    for (size_t at = 0; at < m_points.size(); at++)
        for (size_t i = 0; i < m_points[at].size() && m_points[at][i]; i++)
            m_points[at][i]->m_userPersistentData =
                reinterpret_cast<void *>((step << 34 | uint64_t(at) << 2 | uint64_t(i)) + 1);
}
