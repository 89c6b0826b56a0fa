//! Routes that know their paths, so that a test can see that the description of the interface has all of them.

use axum::Router;
use axum::routing::MethodRouter;

/// Routes with what they need.
#[derive(Debug, Default)]
pub(crate) struct Routes {
    router: Router,
    paths: Vec<&'static str>,
}

impl Routes {
    /// Routes that share a state.
    pub(crate) fn new<S: Clone + Send + Sync + 'static>(
        state: S,
        list: impl IntoIterator<Item = (&'static str, MethodRouter<S>)>,
    ) -> Self {
        let (mut router, mut paths) = (Router::new(), Vec::new());
        for (path, answers) in list {
            router = router.route(path, answers);
            paths.push(path);
        }
        Self { router: router.with_state(state), paths }
    }

    /// Both.
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.router = self.router.merge(other.router);
        self.paths.extend(other.paths);
        self
    }

    /// The paths, in no order.
    #[cfg(test)]
    pub(crate) fn paths(&self) -> &[&'static str] {
        &self.paths
    }

    pub(super) fn into_router(self) -> Router {
        self.router
    }
}
