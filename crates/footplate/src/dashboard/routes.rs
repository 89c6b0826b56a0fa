//! Routes that know their paths, so that a test can compare them with the OpenAPI description.

use axum::Router;
use axum::routing::MethodRouter;

/// Routes and their paths.
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

    /// Joins two sets of routes.
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.router = self.router.merge(other.router);
        self.paths.extend(other.paths);
        self
    }

    /// The paths, unsorted.
    #[cfg(test)]
    pub(crate) fn paths(&self) -> &[&'static str] {
        &self.paths
    }

    pub(super) fn into_router(self) -> Router {
        self.router
    }
}
